"""Logs of robots as loggers write them, judged by a scenario: `airground judge`.

From a file to a verdict:

    stream            positions of one body as one source has them; which body a name is about
    text, columns     text tables: their delimiter and header; what their columns mean
    tables            long and wide tables, one file per robot, TUM, Parquet, as streams
    messages, bags    positions in messages; MCAP files and ROS bags, as streams
    opening           what a file is, by its content
    units             units that a log leaves open
    tracks            streams joined to one track per body, in one frame; drop-outs split a track
    judging           distances and the avoidance law, interval by interval
    words, page       what is said of a log: as lines, and as a page with maps and a replay
"""
