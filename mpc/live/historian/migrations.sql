-- Each part below a line "-- version N" is run once, in order, within one transaction.
-- version 1
CREATE TABLE point (
    id integer GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    name text NOT NULL UNIQUE,
    unit text,
    created timestamptz NOT NULL DEFAULT now()
);
CREATE TABLE sample (
    point integer NOT NULL REFERENCES point (id),
    time timestamptz NOT NULL,
    value double precision NOT NULL,
    PRIMARY KEY (point, time)
);
CREATE INDEX sample_time ON sample USING brin (time);
