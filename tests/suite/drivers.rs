//! GPU drivers that crash or hang in their first calls: these calls run in a child process, so that no command dies with them.
#![cfg(target_os = "linux")]

use std::process::Command;

use crate::common::program::{Desk, SPEC, large};

/// Builds a Vulkan driver that does `what` in its call `place`; with `nothing` it loads and has no device.
fn driver(desk: &Desk, place: &str, what: &str) -> String {
    let at = |name: &str| if name == place { what } else { "" };
    let source = format!(
        "#include <signal.h>\n#include <stdint.h>\n#include <string.h>\n#include <unistd.h>\n\
         typedef void (*Call)(void);\n\
         static int32_t create(const void *info, const void *host, void **instance) {{ {} return -9; }}\n\
         static int32_t extensions(const char *layer, uint32_t *n, void *all) {{ {} *n = 0; return 0; }}\n\
         int32_t vk_icdNegotiateLoaderICDInterfaceVersion(uint32_t *version) {{ {} *version = 5; return 0; }}\n\
         Call vk_icdGetInstanceProcAddr(void *instance, const char *name) {{\n\
         if (!strcmp(name, \"vkCreateInstance\")) return (Call)create;\n\
         if (!strcmp(name, \"vkEnumerateInstanceExtensionProperties\")) return (Call)extensions;\n\
         return 0;\n}}\n",
        at("vkCreateInstance"),
        at("vkEnumerateInstanceExtensionProperties"),
        at("negotiate"),
    );
    desk.write("driver.c", source);
    let flags = ["-shared", "-fPIC", "-o", "driver.so", "driver.c"];
    assert!(
        Command::new("cc").current_dir(desk.path(".")).args(flags).status().expect("a C compiler").success()
    );
    let library = desk.path("driver.so").display().to_string();
    let told = format!(
        r#"{{"file_format_version": "1.0.0", "ICD": {{"library_path": "{library}", "api_version": "1.1.0"}}}}"#
    );
    desk.write("driver.json", told);
    desk.path("driver.json").display().to_string()
}

#[test]
fn a_driver_that_crashes_in_its_first_calls_takes_no_command_with_it() {
    for (place, what, why) in [
        ("vkCreateInstance", "*(volatile int *)0 = 1;", "crashed (signal: 11 (SIGSEGV)"),
        ("vkCreateInstance", "raise(SIGABRT);", "crashed (signal: 6 (SIGABRT)"),
        (
            "vkEnumerateInstanceExtensionProperties",
            "*(volatile int *)0 = 1;",
            "crashed (signal: 11 (SIGSEGV)",
        ),
        ("negotiate", "raise(SIGKILL);", "crashed (signal: 9 (SIGKILL)"),
        ("vkCreateInstance", "_exit(3);", "crashed (exit status: 3)"),
    ] {
        let desk = Desk::new(SPEC);
        let path = driver(&desk, place, what);
        let variables = [("VK_DRIVER_FILES", path.as_str()), ("VK_ICD_FILENAMES", path.as_str())];
        let run = |arguments: &[&str]| desk.run_with(arguments, &variables);
        desk.write("large.toml", large());
        let ran = run(&["sweep", "large.toml", "--plan", "--json"]).exits(0).json();
        let reason = ran["backend"]["reason"].as_str().unwrap();
        assert!(ran["backend"]["name"] == "cpu" && reason.contains(why), "{place}: {reason}");
        let ran = run(&["devices"]).exits(0);
        assert!(ran.stdout.contains(why) && ran.stdout.contains("auto takes: CPU kernels"), "{}", ran.stdout);
        let ran = run(&["sweep", "spec.toml", "--backend", "gpu", "--out", "gpu"]).exits(2);
        assert!(ran.stderr.contains(why) && ran.stderr.contains("--backend"), "{}", ran.stderr);
        let ran = run(&["verify", "spec.toml", "--samples", "2"]).exits(0);
        assert!(ran.stderr.contains(why), "{}", ran.stderr);
        run(&["bench", "--plan", "--quick"]).exits(0);
        assert!(!desk.path("gpu").exists());
    }
}
