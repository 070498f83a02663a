"""From a recording to its angle random walk: `pipeline` is the path, `headline` the choice of N.

The room takes a recording and `Settings` and gives an `Analysis`, a verdict on it and a forecast.
It knows nothing of pages and figures, or of how its choices are typed on a command line; of files
only that an `Analysis` goes into JSON.
"""
