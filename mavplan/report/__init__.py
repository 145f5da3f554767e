"""A plan as one page that opens without a network: map, profile, timeline, tables. Text out; writing it is not here.

`content` gathers what is shown, `axes` cuts scales into round steps, `page` fills ``page.html.jinja`` with both.
"""
