"""Pictures of plans, drawn with matplotlib (extra ``figures``). Drawing functions take an ``Axes`` and return it."""
