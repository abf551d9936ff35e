"""The parts of the guest that need no guest: archive, kernel, what is missing, and how a machine's end is told."""

import lzma
import signal
import subprocess
from pathlib import Path

import pytest

from tests.vcan import guest, needs
from tests.vcan.initramfs import EXIT_FILE, init_script, initramfs
from tests.vcan.kernel import Kernel, depends, elf_image, newest_package

pytestmark = pytest.mark.tool


def entries(archive):
    """(name, mode, data) by the format's description: a number's place, each part filled up to four bytes."""
    at = 0
    while True:
        assert archive[at : at + 6] == b"070701"
        mode, size, name_size = (int(archive[at + place : at + place + 8], 16) for place in (14, 54, 94))
        name = archive[at + 110 : at + 110 + name_size - 1].decode()
        begin = at + (110 + name_size + 3) // 4 * 4
        if name == "TRAILER!!!":
            assert begin == len(archive)
            return
        yield name, mode, archive[begin : begin + size]
        at = begin + (size + 3) // 4 * 4


@pytest.fixture
def kernel(tmp_path):
    """A package's folder with four modules, of which one needs two others and one lies about nothing."""
    needed = {"can": "", "can-dev": "", "vcan": "can-dev", "can-raw": "can", "odd": "can_raw,vcan"}
    folder = tmp_path / "lib/modules/6.1-test/kernel/net"
    folder.mkdir(parents=True)
    for name, others in needed.items():
        (folder / f"{name}.ko").write_bytes(b"\x7fELF\0license=GPL\0depends=" + others.encode() + b"\0name=x\0")
    (tmp_path / "boot").mkdir()
    (tmp_path / "boot/vmlinuz-6.1-test").write_bytes(b"MZ" + lzma.compress(b"\x7fELF kernel") + b"tail")
    return Kernel(tmp_path)


def test_the_kernels_image_is_unpacked_from_its_vmlinuz(kernel):
    assert (kernel.version, kernel.image.read_bytes()) == ("6.1-test", b"\x7fELF kernel")


@pytest.mark.parametrize("packed", [b"MZ", b"MZ" + lzma.compress(b"no kernel")])
def test_a_vmlinuz_of_another_kind_is_refused(packed):
    with pytest.raises(ValueError, match="xz"):
        elf_image(packed)


def test_each_module_comes_once_and_after_what_it_needs(kernel):
    names = [path.stem for path in kernel.modules(("odd", "can"))]
    assert sorted(names) == ["can", "can-dev", "can-raw", "odd", "vcan"]
    for before, after in (("can", "can-raw"), ("can-dev", "vcan"), ("can-raw", "odd"), ("vcan", "odd")):
        assert names.index(before) < names.index(after)


def test_a_module_that_the_kernel_has_not_is_an_error(kernel):
    with pytest.raises(KeyError, match="9p"):
        kernel.modules(("9p",))


def test_a_module_that_names_no_other_depends_on_nothing():
    assert depends(b"\x7fELF\0depends=\0") == depends(b"\x7fELF") == ()


def test_the_archive_holds_busybox_the_modules_and_the_script(tmp_path, kernel):
    busybox = tmp_path / "busybox"
    busybox.write_bytes(b"12345")
    modules = kernel.modules(("can_raw",))
    found = {name: (mode, data) for name, mode, data in entries(initramfs(busybox, modules, "#!/busybox sh\n"))}
    assert found["busybox"] == (0o100755, b"12345")
    assert found["init"] == (0o100755, b"#!/busybox sh\n")
    assert found["host"] == (0o040755, b"")
    assert found["can-raw.ko"][1] == modules[-1].read_bytes()


def test_the_script_quotes_what_it_is_given(kernel):
    script = init_script(kernel.modules(("can",)), Path("/a b"), {"A": "x y"}, "echo 'it is'")
    assert "insmod /$module" in script and "for module in can.ko;" in script
    assert "/host'/a b'" in script and "'A=x y'" in script and """-c 'echo '"'"'it is'"'"''""" in script


def test_missing_programs_are_named_by_package_with_the_command_that_installs_them(tmp_path):
    assert needs.missing(needs.GUEST, str(tmp_path)) == list(needs.GUEST.values())
    for program in needs.GUEST:
        (tmp_path / program).symlink_to("/bin/true")
    assert needs.missing(needs.GUEST, str(tmp_path)) == []
    assert needs.install(["can-utils"]).endswith("sudo apt-get install -y --no-install-recommends can-utils")


def test_the_newest_kernel_package_is_taken(tmp_path):
    assert newest_package(tmp_path) is None
    package = tmp_path / "linux-image-6.1.0-1-amd64_6.1_amd64.deb"
    package.touch()
    assert newest_package(tmp_path) == package


def machine(monkeypatch, kernel, work, script, limit_s):
    """The guest's run with a shell command in place of QEMU."""
    work.mkdir()
    monkeypatch.setattr(guest, "_command", lambda *_: ["sh", "-c", script])
    monkeypatch.setattr(Kernel, "modules", lambda _: [])
    return guest.run(kernel, Path("/bin/sh"), guest.Job("true", work, {}, limit_s))


def test_what_the_guest_prints_and_its_exit_code_come_through(monkeypatch, kernel, tmp_path, capsys):
    script = f"printf 'one\\r\\ntwo\\r\\n'; echo 7 > {tmp_path}/work/{EXIT_FILE}"
    assert machine(monkeypatch, kernel, tmp_path / "work", script, 60.0) == 7
    assert capsys.readouterr().out == "one\ntwo\n"


def test_a_guest_that_ends_without_an_exit_code_is_an_error(monkeypatch, kernel, tmp_path):
    with pytest.raises(guest.GuestError, match="ended before its command did"):
        machine(monkeypatch, kernel, tmp_path / "work", "echo panic", 60.0)


def test_a_guest_that_takes_too_long_is_killed(monkeypatch, kernel, tmp_path):
    class Spied(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            started.append(self)

    started = []
    monkeypatch.setattr(guest.subprocess, "Popen", Spied)
    with pytest.raises(guest.GuestError, match="not done within 0 s"):
        machine(monkeypatch, kernel, tmp_path / "work", "exec sleep 600", 0.0)
    assert [process.returncode for process in started] == [-signal.SIGKILL]
