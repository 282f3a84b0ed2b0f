"""From drawings and device lists to a case: raster, vector and coded plans; devices of CSV, Brick and Haystack.

Needs the extra ``[plan]`` (``pip install "buildingmpc[plan]"``); its packages are imported when they are first used.
"""
