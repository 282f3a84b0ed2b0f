"""Samples of a building's points in PostgreSQL.

`Samples` (:mod:`.samples`) is what is written: names, times [s since 1970, UTC] and values, one entry a sample.
`Historian` (:mod:`.store`) makes and migrates its schema (`migrate`), writes (`write` returns after the commit), reads
(`read` a table by time, `latest` the last value of each point, `points` what there is) and forgets (`trim`).
`Recorder` (:mod:`.recorder`) is what a collector writes through: a sample is acknowledged once the database has
committed it, or, while there is none, once it is on disk in the `Spool` (:mod:`.spool`), which is back-filled later.
"""
