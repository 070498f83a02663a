"""The page to work in: a server on this machine alone, and what it serves to one browser.

It calls what ``import sagnac`` gives and draws what that returns; it estimates nothing itself.
It must not know the rooms of the package, other machines, or what a page has asked for before.
"""
