"""An analysis as files: a page of Markdown, JSON, and pictures.

The reader of the page builds a feeder: places and sides of rest, reliability of the answer, and
assumptions.  Numbers are read from the analysis, never computed anew here.
"""
