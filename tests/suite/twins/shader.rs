//! A shader as naga reads it: its functions, what they assign, what they call, the numbers in them.

use std::collections::{BTreeMap, BTreeSet};

use naga::UnaryOperator;
use naga::proc::TypeResolution;
use naga::valid::{Capabilities, FunctionInfo, ValidationFlags, Validator};
use naga::{BinaryOperator, Block, Expression, Handle, Literal, MathFunction, Module, Statement, TypeInner};

use super::Twin;
use super::formula::{Formula, number};
use super::function::Function;

/// A parsed shader.
pub struct Shader {
    /// By name; the emitted `sobol0`, `sobol1`, … are one.
    pub functions: BTreeMap<String, Function>,
    /// Named numbers.
    pub constants: BTreeMap<String, f64>,
    /// Fields of structs.
    pub structs: BTreeMap<String, Vec<String>>,
}

struct Reader<'a> {
    module: &'a Module,
    info: &'a FunctionInfo,
    function: &'a naga::Function,
    twins: &'a [Twin],
    /// Results of calls.
    results: BTreeMap<Handle<Expression>, Formula>,
    found: Function,
}

fn literal(l: &Literal) -> Option<f64> {
    match *l {
        Literal::F64(x) | Literal::AbstractFloat(x) => Some(x),
        Literal::F32(x) => Some(f64::from(x)),
        Literal::U32(x) => Some(f64::from(x)),
        Literal::I32(x) => Some(f64::from(x)),
        Literal::AbstractInt(x) => Some(x as f64),
        _ => None,
    }
}

impl Shader {
    /// Reads `text`; `twins` say which arguments have no counterpart.
    pub fn new(text: &str, twins: &[Twin]) -> Result<Self, String> {
        let module = naga::front::wgsl::parse_str(text).map_err(|e| e.emit_to_string(text))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::FLOAT64)
            .validate(&module)
            .map_err(|e| e.emit_to_string(text))?;
        let constants = module.constants.iter().filter_map(|(_, c)| {
            let Expression::Literal(l) = &module.global_expressions[c.init] else { return None };
            Some((c.name.clone()?, literal(l)?))
        });
        let constants: BTreeMap<String, f64> = constants.collect();
        let structs = module.types.iter().filter_map(|(_, t)| {
            let TypeInner::Struct { members, .. } = &t.inner else { return None };
            Some((t.name.clone()?, members.iter().filter_map(|m| m.name.clone()).collect()))
        });
        let structs = structs.collect();
        let mut functions = BTreeMap::new();
        let entries =
            module.entry_points.iter().enumerate().map(|(i, e)| (&e.function, info.get_entry_point(i), None));
        let all = module.functions.iter().map(|(h, f)| (f, &info[h], Some(module.functions.get_span(h))));
        for (function, info, span) in all.chain(entries) {
            let name = function.name.clone().unwrap_or_else(|| "main".to_owned());
            let numbered = name.trim_end_matches(|c: char| c.is_ascii_digit());
            let name = if numbered == "sobol" { numbered.to_owned() } else { name };
            let mut reader = Reader {
                module: &module,
                info,
                function,
                twins,
                results: BTreeMap::new(),
                found: Function::default(),
            };
            reader.found.parameters = function.arguments.iter().filter_map(|a| a.name.clone()).collect();
            for (_, local) in function.local_variables.iter() {
                if let (Some(name), Some(init)) = (&local.name, local.init) {
                    let value = reader.value(init);
                    reader.found.assign(name, "", &value);
                }
            }
            reader.block(&function.body, "");
            if let Some(span) = span.and_then(|s| s.to_range()) {
                reader.found.constants = numbers(&text[span], &constants, name == "design");
            }
            functions.insert(name, reader.found);
        }
        Ok(Self { functions, constants, structs })
    }
}

/// Numbers and named numbers in the text of a function. Those that Rust wrote into it have the suffix of a float: they are data; where it is
/// `sized`, those of the suffix of an integer too.
fn numbers(text: &str, named: &BTreeMap<String, f64>, sized: bool) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for line in text.lines() {
        let line = line.split("//").next().unwrap_or_default();
        if sized && line.contains("array<") {
            continue;
        }
        for token in super::function::tokens(line) {
            let digit = token.starts_with(|c: char| c.is_ascii_digit());
            if !digit && named.contains_key(&token) {
                all.insert(token);
            } else if digit && !(sized && token.ends_with('u')) {
                let hex = token.strip_prefix("0x");
                let plain = match hex {
                    Some(hex) => u32::from_str_radix(hex.trim_end_matches('u'), 16).ok().map(f64::from),
                    None => token.trim_end_matches(['u', 'i']).parse().ok(),
                };
                all.extend(plain.map(number));
            }
        }
    }
    all
}

impl Reader<'_> {
    fn inner(&self, e: Handle<Expression>) -> &TypeInner {
        let inner = match &self.info[e].ty {
            TypeResolution::Handle(h) => &self.module.types[*h].inner,
            TypeResolution::Value(inner) => inner,
        };
        match inner {
            TypeInner::Pointer { base, .. } => &self.module.types[*base].inner,
            inner => inner,
        }
    }

    /// What `e` is, by the name that it was given, if any.
    fn value(&self, e: Handle<Expression>) -> Formula {
        if let Some(name) = self.function.named_expressions.get(&e) {
            let fixed = matches!(
                self.function.expressions[e],
                Expression::Literal(_) | Expression::Constant(_) | Expression::ZeroValue(_)
            );
            return if fixed { self.whole(e) } else { Formula::name(name) };
        }
        self.whole(e)
    }

    /// What `e` is, whatever its name.
    fn whole(&self, e: Handle<Expression>) -> Formula {
        let value = |e| self.value(e);
        match &self.function.expressions[e] {
            Expression::Literal(Literal::Bool(b)) => Formula::name(b.to_string()),
            Expression::Literal(l) => Formula::number(literal(l).unwrap_or(f64::NAN)),
            Expression::Constant(c) => {
                let constant = &self.module.constants[*c];
                match &self.module.global_expressions[constant.init] {
                    Expression::Literal(Literal::Bool(_)) => {}
                    Expression::Literal(l) => return Formula::number(literal(l).unwrap_or(f64::NAN)),
                    _ => {}
                }
                Formula::name(constant.name.clone().unwrap_or_default())
            }
            Expression::ZeroValue(_) => Formula::number(0.0),
            Expression::FunctionArgument(i) => {
                Formula::name(self.function.arguments[*i as usize].name.clone().unwrap_or_default())
            }
            Expression::LocalVariable(v) => {
                Formula::name(self.function.local_variables[*v].name.clone().unwrap_or_default())
            }
            Expression::GlobalVariable(v) => {
                Formula::name(self.module.global_variables[*v].name.clone().unwrap_or_default())
            }
            Expression::Load { pointer } => value(*pointer),
            Expression::Access { base, index } => {
                Formula::name(format!("{}[{}]", value(*base), value(*index)))
            }
            Expression::AccessIndex { base, index } => {
                let name = match self.inner(*base) {
                    TypeInner::Struct { members, .. } => {
                        format!(".{}", members[*index as usize].name.clone().unwrap_or_default())
                    }
                    _ => format!("[{index}]"),
                };
                Formula::name(format!("{}{name}", value(*base)))
            }
            Expression::Unary { op, expr } => match op {
                UnaryOperator::Negate => -value(*expr),
                UnaryOperator::LogicalNot => value(*expr).not(),
                UnaryOperator::BitwiseNot => Formula::call("not", &[value(*expr)]),
            },
            Expression::Binary { op, left, right } => {
                let (a, b) = (value(*left), value(*right));
                use BinaryOperator as B;
                match op {
                    B::Add => a + b,
                    B::Subtract => a - b,
                    B::Multiply => a * b,
                    B::Divide => a / b,
                    B::Less => Formula::name(format!("{a} < {b}")),
                    B::Greater => Formula::name(format!("{b} < {a}")),
                    B::LogicalAnd => Formula::call("and", &[a, b]),
                    B::LogicalOr => Formula::call("or", &[a, b]),
                    op => Formula::call(&format!("{op:?}"), &[a, b]),
                }
            }
            Expression::Select { condition, accept, reject } => {
                Formula::call("select", &[value(*reject), value(*accept), value(*condition)])
            }
            Expression::Math { fun, arg, arg1, arg2, .. } => {
                let mut list = vec![value(*arg)];
                list.extend([arg1, arg2].into_iter().flatten().map(|a| value(*a)));
                match (fun, list.as_slice()) {
                    (MathFunction::Fma, [a, b, c]) => a.clone() * b.clone() + c.clone(),
                    (MathFunction::Clamp, [x, lo, hi]) => {
                        let most = Formula::call("max", &[x.clone(), lo.clone()]);
                        Formula::call("min", &[most, hi.clone()])
                    }
                    _ => Formula::call(&format!("{fun:?}").to_lowercase(), &list),
                }
            }
            Expression::As { expr, .. } | Expression::Splat { value: expr, .. } => value(*expr),
            Expression::Compose { components, .. } => {
                let list: Vec<Formula> = components.iter().map(|c| value(*c)).collect();
                Formula::call("", &list)
            }
            Expression::CallResult(_) => self.results.get(&e).cloned().unwrap_or_default(),
            other => Formula::name(format!("{other:?}")),
        }
    }

    fn assign(&mut self, name: &str, guard: &str, e: Handle<Expression>) {
        // A struct's fields, by name; a selection, case by case.
        match &self.function.expressions[e] {
            Expression::Compose { ty, components } => {
                let TypeInner::Struct { members, .. } = &self.module.types[*ty].inner else { return };
                let fields: Vec<_> = members.iter().filter_map(|m| m.name.clone()).collect();
                let ty = self.module.types[*ty].name.clone().unwrap_or_default();
                for (field, c) in fields.iter().zip(components) {
                    let value = self.value(*c);
                    self.found.assign(&format!("{ty}.{field}"), guard, &value);
                }
            }
            Expression::Select { condition, accept, reject } => {
                let (yes, no) = (self.value(*accept), self.value(*reject));
                let condition = self.value(*condition).to_string();
                self.found.assign(name, &condition, &yes);
                self.found.assign(name, "", &no);
            }
            _ => {
                let value = self.whole(e);
                self.found.assign(name, guard, &value);
            }
        }
    }

    fn block(&mut self, block: &Block, guard: &str) {
        for statement in block.iter() {
            match statement {
                Statement::Emit(range) => {
                    for e in range.clone() {
                        if let Some(name) = self.function.named_expressions.get(&e).cloned() {
                            self.assign(&name, guard, e);
                        }
                    }
                }
                Statement::Block(b) => self.block(b, guard),
                Statement::If { condition, accept, reject } => {
                    let condition = self.value(*condition).to_string();
                    self.block(accept, &condition);
                    self.block(reject, "");
                }
                Statement::Loop { body, continuing, .. } => {
                    self.block(body, guard);
                    self.block(continuing, guard);
                }
                Statement::Store { pointer, value } => {
                    let name = self.value(*pointer).to_string();
                    let named = self.function.named_expressions.contains_key(value);
                    if named {
                        let value = self.value(*value);
                        self.found.assign(&name, guard, &value);
                    } else {
                        self.assign(&name, guard, *value);
                    }
                }
                Statement::Return { value: Some(e) } => {
                    if self.function.named_expressions.contains_key(e) {
                        let value = self.value(*e);
                        self.found.assign("return", guard, &value);
                    } else {
                        self.assign("return", guard, *e);
                    }
                }
                Statement::Call { function, arguments, result } => {
                    let callee = self.module.functions[*function].name.clone().unwrap_or_default();
                    let names = &self.module.functions[*function].arguments;
                    let alone = |name: &str| {
                        self.twins.iter().any(|t| t.wgsl == callee && t.only_wgsl.contains(&name))
                    };
                    let kept =
                        names.iter().zip(arguments).filter(|(a, _)| !alone(a.name.as_deref().unwrap_or("")));
                    for (i, e) in arguments.iter().enumerate() {
                        let argument = self.value(*e).to_string();
                        let other = names.iter().position(|a| a.name.as_ref() == Some(&argument));
                        if other.is_some_and(|j| j != i) {
                            self.found.crossed.push(format!("{argument} in a call of {callee}"));
                        }
                    }
                    let list: Vec<Formula> = kept.map(|(_, e)| self.value(*e)).collect();
                    let call = Formula::call(&callee, &list);
                    self.found.call(&call, self.twins);
                    if let Some(result) = result {
                        self.results.insert(*result, call.clone());
                        if let Some(name) = self.function.named_expressions.get(result) {
                            self.found.assign(name, guard, &call);
                        }
                    }
                }
                _ => {}
            }
        }
    }
}
