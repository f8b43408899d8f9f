"""A GPU driver that crashes in its first call does not take the interpreter with it."""

import json
import os
import shutil
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the driver is one for Linux")

DRIVER = """
#include <string.h>
typedef void (*Call)(void);
static int create(const void *info, const void *host, void **instance) { *(volatile int *)0 = 1; return -9; }
static int extensions(const char *layer, unsigned *n, void *all) { *n = 0; return 0; }
int vk_icdNegotiateLoaderICDInterfaceVersion(unsigned *version) { *version = 5; return 0; }
Call vk_icdGetInstanceProcAddr(void *instance, const char *name) {
    if (!strcmp(name, "vkCreateInstance")) return (Call)create;
    return strcmp(name, "vkEnumerateInstanceExtensionProperties") ? 0 : (Call)extensions;
}
"""

RUN = """
import vibrissa
sections = dict(whisker=dict(D=10, d=4, L_a=50), gauge=dict(x_ss=5, l=2), tap=dict(a=[21, 30], theta=[1, 4]))
vibrissa.sweep(**sections)
backend = vibrissa.devices()["auto"]
print(backend["name"], backend["reason"])
print(vibrissa.devices()["faults"])
try:
    vibrissa.sweep(**sections, run=dict(backend="gpu"))
except vibrissa.InputError as e:
    print(e)
"""


def test_a_driver_that_crashes_is_told_in_words(tmp_path):
    (tmp_path / "driver.c").write_text(DRIVER)
    library = tmp_path / "driver.so"
    subprocess.run([shutil.which("cc"), "-shared", "-fPIC", "-w", "-o", library, tmp_path / "driver.c"], check=True)
    told = tmp_path / "driver.json"
    told.write_text(json.dumps({"file_format_version": "1.0.0", "ICD": {"library_path": str(library), "api_version": "1.1.0"}}))
    variables = {**os.environ, "VK_DRIVER_FILES": str(told), "VK_ICD_FILENAMES": str(told)}
    done = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, timeout=600, env=variables)
    assert done.returncode == 0, (done.returncode, done.stderr)
    lines = done.stdout.splitlines()
    assert len(lines) == 3 and all("crashed (signal: 11 (SIGSEGV)" in line for line in lines), lines
    assert lines[0].startswith("cpu ")
