//! One part of a sweep that is split over several machines: consecutive designs, as equal in number as possible.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Part `index` (from 1) of `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    pub index: u32,
    /// Number of parts.
    pub of: u32,
}

/// Maximum number of parts.
pub const MOST: u32 = 1_000_000;

impl Shard {
    /// The whole as one part.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// Its designs among `n`. The parts are consecutive and complete; a part may be empty.
    pub fn designs(self, n: u64) -> Range<u64> {
        let end = |parts: u32| (u128::from(n) * u128::from(parts) / u128::from(self.of)) as u64;
        end(self.index - 1)..end(self.index)
    }

    /// Name of its folder in the folder of the whole.
    pub fn folder(self) -> String {
        format!("shard-{}-of-{}", self.index, self.of)
    }

    /// The part whose folder has this name, if any.
    pub fn of_folder(name: &str) -> Option<Self> {
        let (index, of) = name.strip_prefix("shard-")?.split_once("-of-")?;
        let shard: Self = format!("{index}/{of}").parse().ok()?;
        (shard.folder() == name).then_some(shard)
    }

    /// The part of a task in a Slurm array, from Slurm's environment variables; an error if only some tasks of the array run.
    pub fn of_slurm(variable: impl Fn(&str) -> Option<String>) -> Result<Self, String> {
        let number = |name: &str| {
            let name = format!("SLURM_ARRAY_TASK_{name}");
            let text = variable(&name)
                .ok_or_else(|| format!("{name} is not set: this is not a task of a Slurm array"))?;
            text.trim().parse::<u32>().map_err(|_| format!("{name} = {text} is no number"))
        };
        let (id, count, min, max) = (number("ID")?, number("COUNT")?, number("MIN")?, number("MAX")?);
        let step = variable("SLURM_ARRAY_TASK_STEP").map_or(Ok(1), |_| number("STEP"))?;
        let why = if !(1..=MOST).contains(&count) || step == 0 || max < min || !(min..=max).contains(&id) {
            "this is not an array of which the part could be told"
        } else if count == 1 {
            // Tasks that are submitted again form a smaller array, which does not state the original number of parts.
            "one task alone does not say of how many parts it is one"
        } else if (max - min) / step + 1 != count || (id - min) % step != 0 {
            "its tasks do not follow each other in even steps, so that which part each is cannot be told"
        } else {
            return Ok(Self { index: (id - min) / step + 1, of: count });
        };
        let told = format!("task {id} of {count}, numbered from {min} to {max} in steps of {step}");
        Err(format!("{told}: {why}; say it as --shard i/n"))
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let shard = numbers.map(|(index, of)| Self { index, of });
        let fits = |s: &Self| (1..=MOST).contains(&s.of) && (1..=s.of).contains(&s.index);
        shard.filter(fits).ok_or_else(|| format!("allowed: i/n with 1 ≤ i ≤ n ≤ {MOST}, as 2/8; or slurm"))
    }
}
