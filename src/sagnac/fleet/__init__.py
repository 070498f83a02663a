"""Many recordings, one table: planned, measured by several processes, resumed, and put together.

`campaign` is what the door calls. `tasks` makes tasks of files and does one of them in any process,
`runner` says where and keeps what is done, `table` and `page` are what comes out. `design` and
`study` say how N scatters over units, days and runs, and what the next one will show.
"""
