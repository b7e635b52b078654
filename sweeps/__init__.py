"""Scripts on the package: `examples` to begin with, `studies` behind the guide's tables, `benchmarks` of its speed."""
