"""The page of a site: health, metrics, what goes on, and the requests of operators."""
