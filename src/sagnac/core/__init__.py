"""What every room uses: arrays, marks, units, errors, documents, compiled loops, processes.

It knows nothing of gyros, tables or recordings: what belongs to one idea stands in its room.
"""
