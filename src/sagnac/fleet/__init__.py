"""Many recordings, one table: planned, measured by several processes, resumed, and put together.

`config` makes tasks of files, `measure` does one of them in any process, `cluster` and `runner` say
where, and `runner` keeps what is done. `table` and `page` are what comes out.
"""
