"""The page without a browser: its words, shapes and handles, and the gateway."""
