"""What kernels share with the code that calls them: tables, working memory, and their layout.

Nothing here needs a compiler, so an engine without one can use it.
"""
