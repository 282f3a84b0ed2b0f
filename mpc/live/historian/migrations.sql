-- Each part below a line "-- version N" is run once, in order, within one transaction.
-- version 1
CREATE TABLE IF NOT EXISTS point (
    id integer GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    name text NOT NULL UNIQUE,
    unit text,
    created timestamptz NOT NULL DEFAULT now()
);
CREATE TABLE IF NOT EXISTS sample (
    point integer NOT NULL REFERENCES point (id),
    time timestamptz NOT NULL,
    value double precision NOT NULL,
    PRIMARY KEY (point, time)
);
CREATE INDEX IF NOT EXISTS sample_time ON sample USING brin (time);
-- version 2
-- Samples of a day as one value a point, as thermal/intake/historian.py packs and reads them; packing again gains nothing.
CREATE TABLE IF NOT EXISTS packed_day (
    day date,
    point integer REFERENCES point (id),
    count integer NOT NULL,
    samples bytea NOT NULL,
    PRIMARY KEY (day, point)
);
ALTER TABLE packed_day ALTER samples SET STORAGE EXTERNAL;
-- version 3
-- Sums and counts of five minutes of all points of a packed day, as thermal/intake/historian_steps.py makes them.
DELETE FROM packed_day;
CREATE TABLE IF NOT EXISTS packed_slots (
    day date PRIMARY KEY,
    points bytea NOT NULL,
    sums bytea NOT NULL,
    counts bytea NOT NULL
);
ALTER TABLE packed_slots ALTER points SET STORAGE EXTERNAL, ALTER sums SET STORAGE EXTERNAL, ALTER counts SET STORAGE EXTERNAL;
