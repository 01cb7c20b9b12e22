"""A failure leaves no partial file, no temporary file, and an older file as it was."""

import errno
import os
import stat
import subprocess
import sys
import textwrap
import threading

import pytest

import cadskin.export as export
from cadskin.errors import ExportError


def test_the_file_appears_only_when_it_is_complete(tmp_path):
    path = tmp_path / "a.bin"
    with export.atomic_file(path) as stream:
        stream.write(b"first half")
        assert not path.exists()
        stream.write(b", second half")
    assert path.read_bytes() == b"first half, second half"
    assert os.listdir(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("stop", [ValueError, KeyboardInterrupt, MemoryError])
def test_an_error_in_mid_writing_leaves_the_old_file(tmp_path, stop):
    path = export.write_text(tmp_path / "a.txt", "old")

    def write_half():
        with export.atomic_file(path) as stream:
            stream.write(b"new")
            raise stop

    with pytest.raises(stop):
        write_half()
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a file size limit")
def test_a_write_that_the_system_refuses_leaves_nothing(tmp_path):
    """A real refusal in mid-file: the process may write no file above 64 KiB."""
    code = f"""
        import os, resource
        from cadskin.errors import ExportError
        from cadskin.export import atomic_file
        resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536))
        try:
            with atomic_file({str(tmp_path / "big.stl")!r}) as stream:
                stream.write(bytes(1 << 20))
        except ExportError as error:
            assert "big.stl" in str(error) and "disk is full" in str(error), error
        else:
            raise AssertionError("no error")
        assert os.listdir({str(tmp_path)!r}) == []
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], check=True, timeout=60)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_disk_that_is_full_at_the_last_moment_leaves_nothing(tmp_path, monkeypatch, number):
    def full(_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ExportError, match=r"a\.txt.*disk is full.*free some space"):
        export.write_text(tmp_path / "a.txt", "new")
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
@pytest.mark.parametrize("format", export.FORMATS)
def test_a_full_device_gives_a_clear_error_in_every_format(array_box, plain_skin, format):
    with pytest.raises(ExportError, match=r"/dev/full.*disk is full"):
        export.write("/dev/full", plain_skin(array_box), format=format)
    assert stat.S_ISCHR(os.stat("/dev/full").st_mode)


@pytest.mark.parametrize("format", export.FORMATS)
def test_every_format_can_go_through_a_pipe(tmp_path, array_box, plain_skin, format):
    skin = plain_skin(array_box)
    fifo = tmp_path / "pipe"
    os.mkfifo(fifo)
    received = []
    reader = threading.Thread(target=lambda: received.append(fifo.read_bytes()))
    reader.start()
    export.write(fifo, skin, format=format)
    reader.join(timeout=30)
    assert stat.S_ISFIFO(os.stat(fifo).st_mode)
    direct = export.write(tmp_path / "direct", skin, format=format)
    if format in ("npz", "3mf"):  # a zip to a pipe has its sizes behind the data: same content, other bytes
        through = tmp_path / "through.zip"
        through.write_bytes(received[0])
        assert _zip_content(through) == _zip_content(direct)
    else:
        assert received[0] == direct.read_bytes()


def _zip_content(path):
    import zipfile

    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_a_missing_folder_a_folder_and_a_file_as_folder_are_named(tmp_path):
    with pytest.raises(ExportError, match=r"the folder .*nowhere does not exist"):
        export.write_text(tmp_path / "nowhere" / "a.txt", "x")
    with pytest.raises(ExportError, match="it is a folder"):
        export.write_text(tmp_path, "x")
    file = export.write_text(tmp_path / "a.txt", "x")
    with pytest.raises(ExportError, match=r"a\.txt"):
        export.write_text(file / "b.txt", "x")
    with pytest.raises(ExportError, match="cannot write"):
        export.write_text(tmp_path / ("a" * 300 + ".txt"), "x")
    assert os.listdir(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS])
def test_a_folder_that_cannot_be_written_is_named(tmp_path, monkeypatch, number):
    real = os.open

    def refuse(path, flags, *rest, **options):
        if flags & os.O_CREAT:
            raise OSError(number, os.strerror(number))
        return real(path, flags, *rest, **options)

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(ExportError, match=r"not allowed.*folder of your own"):
        export.write_text(tmp_path / "a.txt", "x")


def test_a_read_only_file_is_not_replaced_behind_its_back(tmp_path):
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    path = export.write_text(tmp_path / "a.txt", "old")
    path.chmod(0o444)
    with pytest.raises(ExportError, match="not allowed"):
        export.write_text(path, "new")
    assert path.read_text() == "old"


def test_permissions_follow_the_umask_and_then_the_old_file(tmp_path):
    before = os.umask(0o027)
    try:
        path = export.write_text(tmp_path / "a.txt", "x")
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    path.chmod(0o604)
    export.write_text(path, "y")
    assert stat.S_IMODE(path.stat().st_mode) == 0o604


def test_a_symbolic_link_stays_and_its_target_changes(tmp_path):
    target = export.write_text(tmp_path / "target.txt", "old")
    link = tmp_path / "link.txt"
    link.symlink_to(target)
    assert export.write_text(link, "new") == link
    assert link.is_symlink()
    assert target.read_text() == "new"
