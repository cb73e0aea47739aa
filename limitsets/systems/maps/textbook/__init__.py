"""Maps with answers on paper, one file each: examples and benchmarks use them, and they are templates for a new map.

A new one needs a file here and one line in `limitsets.maps`.
"""
