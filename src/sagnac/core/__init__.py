"""What every room uses: arrays, units, errors and notes, documents, compiled loops, processes.

It knows nothing of gyros, tables or recordings: what belongs to one idea stands in its room.
"""
