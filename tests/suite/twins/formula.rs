//! Arithmetic as both languages write it, in one form: sums of products with factors and terms in alphabetical order. Two texts with the
//! same form are the same formula but for rounding; a fused a b + c is a sum.

use std::collections::BTreeMap;

/// A sum of products of names with a number each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Formula(BTreeMap<String, f64>);

/// Between factors, and before a divisor; characters that no name has.
const TIMES: &str = " · ";
const OVER: &str = "÷";

/// A number to the digits that f32 has; a whole one of 32 bits in full.
pub fn number(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() <= f64::from(u32::MAX) {
        return format!("{x}");
    }
    format!("{:.5e}", x as f32)
}

impl Formula {
    /// A number.
    pub fn number(x: f64) -> Self {
        Self(if x == 0.0 { BTreeMap::new() } else { BTreeMap::from([(String::new(), x)]) })
    }

    /// Something with a name.
    pub fn name(name: impl Into<String>) -> Self {
        let name = name.into();
        Self(BTreeMap::from([(if name.is_empty() { "_".to_owned() } else { name }, 1.0)]))
    }

    /// A call; largest and smallest of several do not depend on the order.
    pub fn call(name: &str, arguments: &[Self]) -> Self {
        let mut list: Vec<String> = arguments.iter().map(Self::to_string).collect();
        if matches!(name, "max" | "min" | "and" | "or") {
            list = list.into_iter().flat_map(|x| inner(name, &x).unwrap_or(vec![x])).collect();
            list.sort();
            list.dedup();
        }
        Self::name(format!("{name}({})", list.join(", ")))
    }

    /// The number that it is.
    pub fn value(&self) -> Option<f64> {
        match self.0.len() {
            0 => Some(0.0),
            1 => self.0.get("").copied(),
            _ => None,
        }
    }

    /// Terms with `sign` times those of `o`.
    fn plus(mut self, o: &Self, sign: f64) -> Self {
        for (name, x) in &o.0 {
            *self.0.entry(name.clone()).or_default() += sign * x;
        }
        self.0.retain(|_, x| *x != 0.0);
        self
    }

    /// One product: its number and its factors.
    fn product(&self) -> (f64, Vec<String>) {
        let mut terms = self.0.iter();
        match (terms.next(), terms.next()) {
            (None, _) => (0.0, vec![]),
            (Some((name, x)), None) if name.is_empty() => (*x, vec![]),
            (Some((name, x)), None) => (*x, factors(name)),
            (Some((_, first)), Some(_)) => {
                let sign = first.signum();
                (sign, vec![format!("({})", Self::default().plus(self, sign))])
            }
        }
    }

    /// A comparison or a condition with `!`.
    pub fn not(&self) -> Self {
        let text = self.to_string();
        match text.strip_prefix('!') {
            Some(rest) => Self::name(rest),
            None => Self::name(format!("!{text}")),
        }
    }
}

fn joined(x: f64, mut factors: Vec<String>) -> Formula {
    // A factor and the same divisor leave nothing.
    while let Some((i, j)) = (0..factors.len()).find_map(|i| {
        let other = format!("{OVER}{}", factors[i]);
        factors.iter().position(|f| *f == other).map(|j| (i, j))
    }) {
        factors.remove(i.max(j));
        factors.remove(i.min(j));
    }
    factors.sort();
    Formula(if x == 0.0 { BTreeMap::new() } else { BTreeMap::from([(factors.join(TIMES), x)]) })
}

impl std::ops::Add for Formula {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        self.plus(&o, 1.0)
    }
}

impl std::ops::Sub for Formula {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self.plus(&o, -1.0)
    }
}

impl std::ops::Neg for Formula {
    type Output = Self;
    fn neg(self) -> Self {
        Self::default().plus(&self, -1.0)
    }
}

impl std::ops::Mul for Formula {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let ((x, mut a), (y, b)) = (self.product(), o.product());
        a.extend(b);
        joined(x * y, a)
    }
}

impl std::ops::Div for Formula {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let ((x, mut a), (y, b)) = (self.product(), o.product());
        let inverse = |f: String| match f.strip_prefix(OVER) {
            Some(f) => f.to_owned(),
            None => format!("{OVER}{f}"),
        };
        a.extend(b.into_iter().map(inverse));
        joined(x / y, a)
    }
}

impl std::fmt::Display for Formula {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.0.is_empty() {
            return f.write_str("0");
        }
        for (i, (name, x)) in self.0.iter().enumerate() {
            let sign = match (i, *x < 0.0) {
                (0, false) => "",
                (0, true) => "-",
                (_, false) => " + ",
                (_, true) => " - ",
            };
            f.write_str(sign)?;
            match (x.abs() == 1.0, name.is_empty()) {
                (true, false) => f.write_str(name)?,
                (_, true) => f.write_str(&number(x.abs()))?,
                (false, false) => write!(f, "{}{TIMES}{name}", number(x.abs()))?,
            }
        }
        Ok(())
    }
}

/// Factors of a product, at its outermost signs.
fn factors(product: &str) -> Vec<String> {
    let (mut depth, mut all, mut now) = (0, Vec::new(), String::new());
    for c in product.chars() {
        depth += i32::from(c == '(' || c == '[') - i32::from(c == ')' || c == ']');
        if c == '·' && depth == 0 {
            all.push(std::mem::take(&mut now).trim().to_owned());
        } else {
            now.push(c);
        }
    }
    all.push(now.trim().to_owned());
    all
}

/// Arguments of `x`, if it is a call of `name` and nothing else.
fn inner(name: &str, x: &str) -> Option<Vec<String>> {
    let list = x.strip_prefix(name)?.strip_prefix('(')?.strip_suffix(')')?;
    let mut depth = 0;
    let closed = list.chars().all(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth >= 0
    });
    closed.then(|| split(list))
}

/// Arguments of a list, at its outermost commas.
fn split(list: &str) -> Vec<String> {
    let (mut depth, mut all, mut now) = (0, Vec::new(), String::new());
    for c in list.chars() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' if depth == 0 => {
                all.push(std::mem::take(&mut now).trim().to_owned());
                continue;
            }
            _ => {}
        }
        now.push(c);
    }
    if !now.trim().is_empty() {
        all.push(now.trim().to_owned());
    }
    all
}
