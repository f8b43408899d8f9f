//! Parts of a sweep by their numbers, and text files read in blocks.

use std::io::Read;

use vibrissa::error::InputError;
use vibrissa::sink::shard::Shard;
use vibrissa::text_file::{LINE, Limit, TextFile};

#[test]
fn parts_leave_nothing_out_and_are_even() {
    for n in [0, 1, 2, 7, 64, 1000, u64::MAX / 3] {
        for of in [1, 2, 3, 7, 64, 1000] {
            let parts: Vec<_> = (1..=of).map(|index| Shard { index, of }.designs(n)).collect();
            assert_eq!((parts[0].start, parts[of as usize - 1].end), (0, n));
            assert!(parts.windows(2).all(|w| w[0].end == w[1].start));
            let sizes = parts.iter().map(|p| p.end - p.start);
            assert!(sizes.clone().max().unwrap() - sizes.min().unwrap() <= 1, "{n} over {of}");
        }
    }
}

#[test]
fn names_are_read_as_they_are_written() {
    let shard = Shard { index: 3, of: 12 };
    assert_eq!((shard.to_string().parse(), Shard::of_folder(&shard.folder())), (Ok(shard), Some(shard)));
    for text in ["0/3", "4/3", "1/0", "1", "1/2/3", "a/b", "-1/3", "1/1000001", "+1/2 "] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
    for name in ["shard-01-of-2", "shard-3-of-2", "shard-1-of-2-old", "shards"] {
        assert_eq!(Shard::of_folder(name), None, "{name}");
    }
}

#[test]
fn tasks_of_an_array_are_parts() {
    // Task number, count, smallest and largest number, step.
    for (all, said) in [
        ("0 4 0 3 1", "1/4"),
        ("4 4 1 4", "4/4"),
        ("6 3 2 6 2", "3/3"),
        // Tasks 3 and 5 alone, as after sending failed ones again.
        ("5 2 3 5 1", "even steps"),
        ("4 2 3 5 2", "even steps"),
        ("- - - - -", "SLURM_ARRAY_TASK_ID is not set"),
        ("x 1 0 0 1", "SLURM_ARRAY_TASK_ID = x is no number"),
        ("3 4 - 4 1", "SLURM_ARRAY_TASK_MIN"),
        ("3 4 1 - 1", "SLURM_ARRAY_TASK_MAX"),
        ("7 1 7 7 1", "task 7 of 1"),
        ("1 1 1 1 1", "one task alone"),
        ("3 4 1 4 0", "not an array"),
        ("0 0 0 0 0", "not an array"),
    ] {
        let of = |name: &str| {
            let at = ["ID", "COUNT", "MIN", "MAX", "STEP"].iter().position(|n| name.ends_with(n))?;
            all.split(' ').nth(at).filter(|text| *text != "-").map(str::to_owned)
        };
        let found = Shard::of_slurm(of).map_or_else(|why| why, |shard| shard.to_string());
        assert!(found.contains(said), "{all}: {found}");
    }
}

struct Slow<'a>(&'a [u8], usize);

impl Read for Slow<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.1.min(buffer.len());
        (&mut self.0).take(n as u64).read(buffer)
    }
}

fn read(bytes: &[u8], step: usize, limit: Limit) -> Result<String, InputError> {
    TextFile::new(Slow(bytes, step), "a.csv", "data", limit).text()
}

#[test]
fn text_is_the_same_in_blocks_of_any_size() {
    let text = "\u{feff}µ,°\r\n1,𝜃\n".repeat(3);
    for step in 1..40 {
        let found = read(text.as_bytes(), step, Limit::Whole).unwrap();
        assert_eq!(found, text.strip_prefix('\u{feff}').unwrap(), "{step}");
    }
}

#[test]
fn what_is_no_text_is_refused_at_its_line() {
    for (bytes, line) in
        [(&b"a\nb\0"[..], 2), (b"a\n\n\xff", 3), (b"a\xc2", 1), (b"\xc2a\n", 1), (b"a\n\xf0\x9f\nb", 2)]
    {
        for step in [1, 2, 3, 100] {
            let error = read(bytes, step, Limit::Lines).unwrap_err();
            assert_eq!((error.line, error.file.as_deref()), (Some(line), Some("a.csv")), "{bytes:?}");
        }
    }
}

#[test]
fn the_longest_line_is_read_and_a_longer_one_refused() {
    for step in [1000, 65_536, 1 << 22] {
        let long = |n: usize| format!("a\n{}\nb\n", "x".repeat(n)).into_bytes();
        assert!(read(&long(LINE), step, Limit::Lines).is_ok());
        let error = read(&long(LINE + 1), step, Limit::Lines).unwrap_err();
        assert_eq!(error.line, Some(2), "{error}");
        assert!(read(&long(LINE + 1), step, Limit::Whole).is_ok());
    }
}
