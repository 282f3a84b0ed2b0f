"""Controllers put together, run on plants and compared: what the commands ``control`` and ``compare`` do."""
