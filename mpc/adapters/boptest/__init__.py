"""BOPTEST, both ways: plants of ours behind its REST API, and a plant behind that API as one of ours.

The server needs the extra ``[pages]``, the client the extra ``[boptest]``; their packages are imported when they are
first used.
"""
