import generated
import pytest


@pytest.fixture(scope="session")
def standard_folder(tmp_path_factory):
    """A folder with the catalogue and the recorded packages, generated."""
    folder = tmp_path_factory.mktemp("generated")
    for package, files in generated.catalog_files().items():
        generated.write_package(folder, package, files)
    for path in sorted(generated.RECORDED.iterdir()):
        generated.write_package(folder, path.name, generated.files_of(path))
    return folder


@pytest.fixture(scope="module")
def standard(standard_folder):
    """The packages of `standard_folder`, importable for one test module."""
    with generated.importable(standard_folder):
        yield standard_folder
