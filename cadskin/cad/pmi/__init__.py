"""Semantic PMI of AP242 STEP files: a Part 21 text reader, tolerances tied to faces, and the writer."""
