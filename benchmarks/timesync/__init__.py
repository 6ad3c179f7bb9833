"""Clock filters on the same streams of stamps."""
