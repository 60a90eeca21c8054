"""Machine code that is kept is thrown away when anything that it is made of has changed."""

from missions.kernels import ROOT, sources_of


def names_of(module: str) -> set[str]:
    return {str(path.relative_to(ROOT)) for path in sources_of(ROOT / module)}


def test_a_kernel_is_made_of_its_module_and_of_all_that_this_imports():
    assert names_of("missions/obstacles.py") >= {"missions/obstacles.py", "missions/world.py", "missions/kernels.py"}


def test_what_it_does_not_import_does_not_matter():
    assert not any(name.startswith(("gcs", "companion", "sitl")) for name in names_of("missions/obstacles.py"))


def test_imports_are_followed_through_modules_and_packages():
    made_of = names_of("sitl/fleet.py")
    assert {"sitl/control/gains.py", "sitl/control/smoothing.py", "missions/obstacles.py"} <= made_of
    assert "sitl/vehicle.py" not in made_of
