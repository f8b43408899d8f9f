//! One part of a sweep that several machines share: whole designs, in order, as many for each as can be.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Part `index` (from 1) of `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1.
    pub index: u32,
    /// Of how many.
    pub of: u32,
}

/// Most parts.
pub const MOST: u32 = 1_000_000;

impl Shard {
    /// The whole.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// Its designs among `n`. Those of all parts follow each other and leave none out; a part may have none.
    pub fn designs(self, n: u64) -> Range<u64> {
        let end = |parts: u32| (u128::from(n) * u128::from(parts) / u128::from(self.of)) as u64;
        end(self.index - 1)..end(self.index)
    }

    /// Name of its folder in that of the whole.
    pub fn folder(self) -> String {
        format!("shard-{}-of-{}", self.index, self.of)
    }

    /// The part whose folder has this name.
    pub fn of_folder(name: &str) -> Option<Self> {
        let (index, of) = name.strip_prefix("shard-")?.split_once("-of-")?;
        let shard: Self = format!("{index}/{of}").parse().ok()?;
        (shard.folder() == name).then_some(shard)
    }

    /// The part that a task of a Slurm array is, from the variables that Slurm sets.
    ///
    /// # Errors
    /// No array, or one of which only some tasks run: how many there are is not known then.
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
            // One task sent again by itself, or several, are an array of their own: of how many parts theirs is one, it does not say.
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
