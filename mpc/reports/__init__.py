"""All words, pages and figures: results carry data only."""
