# `make compare` runs the main study, `make test` the tests, and `make test-all` the slow ones, too, with a million maps
# against Dijkstra; all create .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: install compare quick test test-all lint bench figures docs clean

# The quickest tests of every room: a minute on two cores.
QUICK := $(addprefix tests/, test_config.py test_docs.py test_errors.py test_figures.py test_house.py test_imports.py core \
  $(addprefix arenas/, test_scene.py) \
  $(addprefix mapping/, test_grid.py test_leveling.py) \
  $(addprefix formats/, test_cloud.py test_moving_ai.py test_ros_map.py) \
  $(addprefix planning/, test_path.py) \
  $(addprefix sensing/, test_configs.py test_motion.py test_noise.py) \
  $(addprefix stereo/, test_calibration.py test_images.py test_matching.py test_points.py test_rectify.py) \
  $(addprefix motion/, test_edge.py test_primitives.py) $(addprefix biped/, test_gait.py) \
  $(addprefix physics/, test_inputs.py) \
  $(addprefix executors/, test_primitive_schedule.py) $(addprefix mission/, test_recording.py test_scenes.py) \
  $(addprefix study/, test_clock.py test_store.py test_sweep.py) \
  $(addprefix statistics/, test_sample_size_plan.py test_schema.py test_sweep_points.py) \
  $(addprefix report/, test_measured.py) $(addprefix viewer/, test_mission_choice.py) \
  $(addprefix commands/, test_cache.py test_reproduce.py test_view.py))

$(VENV)/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(None if v >= (3, 11) else "jaxbiped needs Python 3.11 or later; this is %d.%d. Set PYTHON=python3.12, say." % v[:2])'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test,bench]'
	touch $@

install: $(VENV)/installed

compare: install
	$(BIN)/jaxbiped compare configs/studies/compare.toml

quick: install
	$(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile $(QUICK)

test: install
	$(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile

test-all: install
	$(BIN)/python -m pytest -n 2 --dist loadfile
	$(BIN)/python -m tests.planning.million

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: install
	$(BIN)/python -m sweeps.benchmarks.startup
	$(BIN)/python -m sweeps.benchmarks.planning
	$(BIN)/python -m sweeps.benchmarks.mapping
	$(BIN)/python -m sweeps.benchmarks.mission

# Prints those figures of README and the guide again that take under a minute, and compares them with docs/figures.toml.
figures: install
	$(BIN)/python docs/figures.py rerun

# The guide, built into build/site; broken links and names that are not there are errors.
$(VENV)/docs-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	touch $@

docs: $(VENV)/docs-installed
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

clean:
	rm -rf $(VENV) results build *.egg-info
