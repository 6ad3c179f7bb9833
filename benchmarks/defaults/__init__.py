"""What a user gets who has configured nothing: links as `init` writes them, under any load."""
