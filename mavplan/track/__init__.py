"""Where a vehicle really was: a `Track`, and the readers of logs. What users received there is `mavplan.proof`'s."""
