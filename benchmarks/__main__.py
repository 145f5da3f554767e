"""Run every benchmark that ends within a minute or so."""

from benchmarks import planning, sca, startup

for module in (startup, planning, sca):
    module.main()
