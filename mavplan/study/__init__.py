"""Monte Carlo studies of the planners: many random draws of users, every planner on each, means with intervals.

`regime` is the paper's setting, `settings` what one study varies, `cases` one draw, `store` the folder that a study
lives in, `engine` where it runs (`one_thread`), `summary` and `intervals` what comes out, `outputs` the files of it.
"""
