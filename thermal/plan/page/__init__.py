"""The labelling page: floor plans and a list of devices become a case in a browser.

Needs the extra ``[pages]`` (``pip install "buildingmpc[pages]"``) beside ``[plan]``.
"""
