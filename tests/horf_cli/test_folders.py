from horf_cli.folders import new_folder


def test_taken_names_get_the_next_number(tmp_path):
    wanted = tmp_path / "a" / "b"
    folders = [new_folder(wanted) for _ in range(3)]
    assert [folder.name for folder in folders] == ["b", "b-2", "b-3"]
    assert all(folder.is_dir() for folder in folders)


def test_a_file_of_that_name_is_left_alone(tmp_path):
    (tmp_path / "x").write_text("mine")
    assert new_folder(tmp_path / "x").name == "x-2"
    assert (tmp_path / "x").read_text() == "mine"
