//! Rust sources as syn reads them, in the same terms as a shader.

use std::collections::{BTreeMap, BTreeSet};

use syn::visit::Visit;
use syn::{BinOp, Expr, FnArg, ImplItem, Item, Lit, Member, Pat, Stmt, UnOp};

use super::Twin;
use super::formula::{Formula, number};
use super::function::Function;

/// A function, or a closure that has a name.
pub struct Source<'a> {
    /// Names of its parameters, in order.
    pub parameters: Vec<String>,
    body: Body<'a>,
}

enum Body<'a> {
    Block(&'a syn::Block),
    Closure(&'a Expr),
}

/// Functions of a file, tests left out, and named closures as `function/closure`.
pub fn functions<'a>(file: &'a syn::File) -> BTreeMap<String, Source<'a>> {
    let mut all = BTreeMap::new();
    let mut add = |name: String, sig: &'a syn::Signature, block: &'a syn::Block| {
        for (closure, c) in closures(block) {
            let parameters = c.inputs.iter().flat_map(named).collect();
            all.insert(format!("{name}/{closure}"), Source { parameters, body: Body::Closure(&c.body) });
        }
        let parameters = sig.inputs.iter().flat_map(|i| match i {
            FnArg::Typed(t) => named(&t.pat),
            FnArg::Receiver(_) => vec!["self".to_owned()],
        });
        all.insert(name, Source { parameters: parameters.collect(), body: Body::Block(block) });
    };
    for item in &file.items {
        match item {
            Item::Fn(f) => add(f.sig.ident.to_string(), &f.sig, &f.block),
            Item::Impl(i) => {
                let syn::Type::Path(ty) = &*i.self_ty else { continue };
                let ty = ty.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default();
                for item in &i.items {
                    if let ImplItem::Fn(f) = item {
                        add(format!("{ty}::{}", f.sig.ident), &f.sig, &f.block);
                    }
                }
            }
            _ => {}
        }
    }
    all
}

/// Numbers that a file has names for.
pub fn constants(file: &syn::File) -> BTreeMap<String, f64> {
    let list = file.items.iter().filter_map(|item| match item {
        Item::Const(c) => Some((c.ident.to_string(), constant_value(&c.expr)?)),
        _ => None,
    });
    list.collect()
}

/// Fields of the structs of a file.
pub fn structs(file: &syn::File) -> BTreeMap<String, Vec<String>> {
    let fields =
        |s: &syn::ItemStruct| s.fields.iter().filter_map(|f| Some(f.ident.as_ref()?.to_string())).collect();
    let list = file.items.iter().filter_map(|item| match item {
        Item::Struct(s) => Some((s.ident.to_string(), fields(s))),
        _ => None,
    });
    list.collect()
}

fn closures(block: &syn::Block) -> Vec<(String, &syn::ExprClosure)> {
    struct Find<'a>(Vec<(String, &'a syn::ExprClosure)>);
    impl<'a> Visit<'a> for Find<'a> {
        fn visit_local(&mut self, l: &'a syn::Local) {
            if let (Some(name), Some(init)) = (name_of(&l.pat), &l.init)
                && let Expr::Closure(c) = &*init.expr
            {
                self.0.push((name, c));
            }
            syn::visit::visit_local(self, l);
        }
    }
    let mut find = Find(Vec::new());
    find.visit_block(block);
    find.0
}

fn name_of(p: &Pat) -> Option<String> {
    match p {
        Pat::Ident(i) => Some(i.ident.to_string()),
        Pat::Type(t) => name_of(&t.pat),
        _ => None,
    }
}

/// Names that a pattern binds, in order.
fn named(p: &Pat) -> Vec<String> {
    match p {
        Pat::Ident(i) => vec![i.ident.to_string()],
        Pat::Type(t) => named(&t.pat),
        Pat::Reference(r) => named(&r.pat),
        Pat::Tuple(t) => t.elems.iter().flat_map(named).collect(),
        Pat::Slice(s) => s.elems.iter().flat_map(named).collect(),
        _ => vec![],
    }
}

/// What a number's text says.
fn literal(l: &Lit) -> Option<f64> {
    match l {
        Lit::Int(i) => i.base10_parse::<u64>().ok().map(|x| x as f64),
        Lit::Float(f) => f.base10_parse().ok(),
        _ => None,
    }
}

/// Names of numbers that are not what Rust calls them.
fn constant(method: &str) -> Option<&'static str> {
    Some(match method {
        "max_angle" => "MAX_ANGLE",
        "least_rest" => "LEAST_REST",
        "largest_rate" => "LARGEST_RATE",
        "smallest_rate" => "SMALLEST_RATE",
        "settle" => "SETTLE",
        "stop" => "STOP",
        "chart_error" => "CHART_ERROR",
        "passes" => "PASSES",
        _ => return None,
    })
}

/// What functions are read by.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    pub twins: &'a [Twin],
    /// Numbers that the shader has names for.
    pub named: &'a BTreeMap<String, f64>,
    /// Numbers that Rust has names for.
    pub constants: &'a BTreeMap<String, f64>,
    /// Parameters of each Rust function.
    pub signatures: &'a BTreeMap<String, Vec<String>>,
}

/// Reads one function as its twin sees it.
struct Reader<'a> {
    context: Context<'a>,
    renamed: Vec<(String, String)>,
    /// Names that stand for a number.
    numbers: BTreeMap<String, f64>,
    /// Closures that are read on their own.
    closures: BTreeSet<String>,
    found: Function,
}

/// What `source`, the twin of `twin`, says.
pub fn read(context: Context<'_>, twin: &Twin, source: &Source<'_>) -> Function {
    let of = |name: &str| context.named.get(name).copied().unwrap_or(f64::NAN);
    let fixed =
        [("n", of("N")), ("zero", 0.0), ("one", 1.0), ("two", 2.0), ("half", 0.5), ("tiny", of("TINY"))];
    let mut numbers: BTreeMap<String, f64> =
        fixed.into_iter().map(|(name, x)| (name.to_owned(), x)).collect();
    numbers.retain(|_, x| !x.is_nan());
    let renamed: Vec<_> =
        twin.renamed.iter().chain(&super::RENAMED).map(|(a, b)| ((*a).into(), (*b).into())).collect();
    if !twin.unrolled {
        return read_with(context, source, numbers, renamed);
    }
    // A loop over k that the shader has round by round.
    let mut all = Function::default();
    for k in 1..of("N") as usize {
        let mut numbers = numbers.clone();
        numbers.insert("k".to_owned(), k as f64);
        if k == 1 {
            numbers.insert("before".to_owned(), 1.0);
        }
        let p = |k: usize| format!("p{k}");
        let mut renamed = renamed.clone();
        let round = [("now", p(k)), ("before", p(k - 1)), ("next", p(k + 1)), ("x", p(1))];
        renamed.extend(round.into_iter().map(|(a, b)| (a.to_owned(), b)));
        let found = read_with(context, source, numbers, renamed);
        all.parameters = found.parameters;
        all.constants.extend(found.constants);
        all.formulas.extend(found.formulas);
    }
    all
}

fn read_with(
    context: Context<'_>,
    source: &Source<'_>,
    numbers: BTreeMap<String, f64>,
    renamed: Vec<(String, String)>,
) -> Function {
    let own = |t: &Twin| Some(t.rust.rsplit_once('/')?.1.to_owned()).filter(|name| !name.contains(':'));
    let closures = context.twins.iter().filter_map(own).collect();
    let found = Function { parameters: source.parameters.clone(), ..Function::default() };
    let mut reader = Reader { context, renamed, numbers, closures, found };
    match source.body {
        Body::Block(b) => reader.block(b, "", "return"),
        Body::Closure(Expr::Block(b)) => reader.block(&b.block, "", "return"),
        Body::Closure(e) => {
            reader.calls(e);
            reader.assign("return", "", e);
        }
    }
    let mut numbers = Numbers { reader: &reader, all: BTreeSet::new() };
    match source.body {
        Body::Block(b) => numbers.visit_block(b),
        Body::Closure(e) => numbers.visit_expr(e),
    }
    reader.found.constants = numbers.all;
    reader.found
}

impl Reader<'_> {
    fn rename(&self, name: String) -> String {
        let found = self.renamed.iter().find(|(from, _)| *from == name);
        found.map_or(name, |(_, to)| to.clone())
    }

    fn atom(&self, name: String) -> Formula {
        if let Some(x) = self.numbers.get(&name).or_else(|| self.context.named.get(&name)) {
            return Formula::number(*x);
        }
        let name = self.rename(name);
        self.context.named.get(&name).map_or_else(|| Formula::name(name), |x| Formula::number(*x))
    }

    /// Arguments that the twin of `callee` has too, in its order.
    fn kept(&self, callee: &str, list: Vec<&Expr>) -> Vec<Formula> {
        let mut all = Vec::new();
        for e in list {
            match strip(e) {
                Expr::Array(a) => all.extend(a.elems.iter().map(|e| self.value(e))),
                e => {
                    let value = self.value(e);
                    let parts = super::parts(&value.to_string());
                    let same = parts.is_empty();
                    all.extend(parts.into_iter().map(Formula::name));
                    all.extend(same.then_some(value));
                }
            }
        }
        let Some(twin) = self.context.twins.iter().find(|t| t.rust.rsplit([':', '/']).next() == Some(callee))
        else {
            return all;
        };
        let names = twin.parameters(&self.context.signatures[twin.rust]);
        let mut kept: Vec<_> =
            names.into_iter().zip(all).filter(|(n, _)| !twin.only_rust.contains(&n.as_str())).collect();
        if let Some(order) = twin.order {
            kept.sort_by_key(|(name, _)| order.split(' ').position(|n| n == name));
        }
        kept.into_iter().map(|(_, f)| f).collect()
    }

    fn value(&self, e: &Expr) -> Formula {
        match e {
            Expr::Lit(l) => literal(&l.lit).map_or_else(|| Formula::name("?"), Formula::number),
            Expr::Paren(p) => self.value(&p.expr),
            Expr::Group(p) => self.value(&p.expr),
            Expr::Reference(r) => self.value(&r.expr),
            Expr::Cast(c) => self.value(&c.expr),
            Expr::Path(p) => {
                let name = p.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default();
                self.atom(name)
            }
            Expr::Field(f) => {
                let member = match &f.member {
                    Member::Named(n) => n.to_string(),
                    Member::Unnamed(n) => n.index.to_string(),
                };
                let base = self.value(&f.base);
                self.atom(format!("{base}.{member}"))
            }
            Expr::Index(i) => {
                let (base, index) = (self.value(&i.expr), self.value(&i.index));
                self.atom(format!("{base}[{index}]"))
            }
            Expr::Unary(u) => match u.op {
                UnOp::Neg(_) => -self.value(&u.expr),
                UnOp::Not(_) => self.value(&u.expr).not(),
                _ => self.value(&u.expr),
            },
            Expr::Binary(b) => {
                let (x, y) = (self.value(&b.left), self.value(&b.right));
                match b.op {
                    BinOp::Add(_) => x + y,
                    BinOp::Sub(_) => x - y,
                    BinOp::Mul(_) => x * y,
                    BinOp::Div(_) => x / y,
                    BinOp::Lt(_) => Formula::name(format!("{x} < {y}")),
                    BinOp::Gt(_) => Formula::name(format!("{y} < {x}")),
                    BinOp::BitXor(_) => Formula::call("ExclusiveOr", &[x, y]),
                    BinOp::BitAnd(_) => Formula::call("And", &[x, y]),
                    BinOp::BitOr(_) => Formula::call("InclusiveOr", &[x, y]),
                    BinOp::Shr(_) => Formula::call("ShiftRight", &[x, y]),
                    BinOp::Shl(_) => Formula::call("ShiftLeft", &[x, y]),
                    BinOp::And(_) => match (x.to_string().as_str(), y.to_string().as_str()) {
                        // What a kernel without effects leaves out, a shader folds.
                        ("!PLAIN", _) => y,
                        _ => Formula::call("and", &[x, y]),
                    },
                    // Devices have no full Newton.
                    BinOp::Or(_) if y.to_string() == "rule.full" => x,
                    BinOp::Or(_) => Formula::call("or", &[x, y]),
                    _ => Formula::name("?"),
                }
            }
            Expr::MethodCall(m) => self.method(m),
            Expr::Call(c) => {
                let Expr::Path(p) = &*c.func else { return Formula::name("?") };
                let callee = p.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default();
                if matches!(callee.as_str(), "of" | "splat" | "from") {
                    return self.value(&c.args[0]);
                }
                if callee == "open" {
                    // A lane that is done keeps what it has.
                    return self.value(&c.args[0]);
                }
                if callee == "dot" {
                    // A table over the nodes, times what they hold: a function of its own in the shader.
                    let (row, y) = (self.value(&c.args[1]).to_string(), self.value(&c.args[2]));
                    let (table, at) = row.split_once('[').map_or((row.as_str(), ""), |(t, at)| (t, at));
                    let name = match table {
                        "tables.weights" => "weigh",
                        "tables.integral" => "integrate",
                        "tables.legendre" => "coefficients",
                        other => other,
                    };
                    let call = Formula::call(name, &[y]);
                    return if at.is_empty() { call } else { Formula::name(format!("{call}[{at}")) };
                }
                let list = self.kept(&callee, c.args.iter().collect());
                Formula::call(&self.rename(callee), &list)
            }
            Expr::If(i) => {
                let yes = tail(&i.then_branch).map(|e| self.value(e)).unwrap_or_default();
                let no = i.else_branch.as_ref().map(|(_, e)| self.value(e)).unwrap_or_default();
                Formula::call("select", &[no, yes, self.value(&i.cond)])
            }
            Expr::Block(b) => tail(&b.block).map(|e| self.value(e)).unwrap_or_default(),
            Expr::Array(a) => Formula::call("", &a.elems.iter().map(|e| self.value(e)).collect::<Vec<_>>()),
            Expr::Struct(s) => {
                let ty = s.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default();
                Formula::name(ty.to_lowercase())
            }
            _ => Formula::name("?"),
        }
    }

    fn method(&self, m: &syn::ExprMethodCall) -> Formula {
        let name = m.method.to_string();
        let receiver = self.value(&m.receiver);
        if let Some(c) = constant(&name) {
            return self.context.named.get(c).map_or_else(|| Formula::name(c), |x| Formula::number(*x));
        }
        let list: Vec<Formula> = m.args.iter().map(|e| self.value(e)).collect();
        if let (("max", [lo]), Expr::MethodCall(inner)) =
            ((name.as_str(), list.as_slice()), strip(&m.receiver))
            && inner.method == "min"
            && lo.value().is_some()
            && self.value(&inner.args[0]).value().is_some()
        {
            // Between two numbers, in either order.
            let most = Formula::call("max", &[self.value(&inner.receiver), lo.clone()]);
            return Formula::call("min", &[most, self.value(&inner.args[0])]);
        }
        match (name.as_str(), list.as_slice()) {
            ("mul_add", [b, c]) => receiver * b.clone() + c.clone(),
            ("wrapping_mul", [b]) => receiver * b.clone(),
            ("wrapping_add", [b]) => receiver + b.clone(),
            ("reverse_bits", []) => Formula::call("reversebits", &[receiver]),
            ("abs", []) => self.atom(Formula::call("abs", &[receiver]).to_string()),
            ("max" | "min" | "sqrt", _) => Formula::call(&name, &[vec![receiver], list].concat()),
            ("if_less", [than, yes, no]) => Formula::call(
                "select",
                &[no.clone(), yes.clone(), Formula::name(format!("{receiver} < {than}"))],
            ),
            ("into" | "clone" | "get", []) => receiver,
            ("nodes", []) => {
                self.numbers.get("n").map_or_else(|| Formula::name("n"), |n| Formula::number(*n))
            }
            _ => {
                let list = self.kept(&name, m.args.iter().collect());
                Formula::call(&self.rename(name), &list)
            }
        }
    }

    /// Notes every call in `e`.
    fn calls(&mut self, e: &Expr) {
        struct Calls<'a, 'b>(&'b mut Reader<'a>);
        impl Visit<'_> for Calls<'_, '_> {
            fn visit_expr_call(&mut self, c: &syn::ExprCall) {
                let call = self.0.value(&Expr::Call(c.clone()));
                self.0.found.call(&call, self.0.context.twins);
                syn::visit::visit_expr_call(self, c);
            }
            fn visit_expr_struct(&mut self, s: &syn::ExprStruct) {
                self.0.assign("", "", &Expr::Struct(s.clone()));
                syn::visit::visit_expr_struct(self, s);
            }
            fn visit_expr_method_call(&mut self, c: &syn::ExprMethodCall) {
                let call = self.0.method(c);
                self.0.found.call(&call, self.0.context.twins);
                syn::visit::visit_expr_method_call(self, c);
            }
        }
        Calls(self).visit_expr(e);
    }

    fn assign(&mut self, name: &str, guard: &str, e: &Expr) {
        match strip(e) {
            Expr::If(i) => {
                self.calls(&i.cond);
                let condition = self.value(&i.cond).to_string();
                self.block(&i.then_branch, &condition, name);
                if let Some((_, other)) = &i.else_branch {
                    self.assign(name, "", other);
                }
            }
            Expr::Block(b) => self.block(&b.block, guard, name),
            Expr::MethodCall(m) if m.method == "if_less" => {
                self.calls(e);
                let condition = format!("{} < {}", self.value(&m.receiver), self.value(&m.args[0]));
                let (yes, no) = (self.value(&m.args[1]), self.value(&m.args[2]));
                self.put(name, &condition, &yes);
                self.put(name, "", &no);
            }
            Expr::Array(syn::ExprArray { elems, .. }) | Expr::Tuple(syn::ExprTuple { elems, .. }) => {
                for (i, e) in elems.iter().enumerate() {
                    self.assign(&format!("{name}[{i}]"), guard, e);
                }
            }
            Expr::Struct(s) => {
                let ty = s.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default();
                for field in &s.fields {
                    if let Member::Named(member) = &field.member {
                        self.assign(&format!("{ty}.{member}"), guard, &field.expr);
                    }
                }
            }
            Expr::Repeat(_) | Expr::Closure(_) | Expr::Match(_) => {
                self.calls(e);
            }
            e => {
                self.calls(e);
                let value = self.value(e);
                self.put(name, guard, &value);
            }
        }
    }

    fn put(&mut self, name: &str, guard: &str, value: &Formula) {
        let name = self.rename(name.to_owned());
        self.found.assign(&name, guard, value);
    }

    fn bind(&mut self, pat: &Pat, guard: &str, e: &Expr) {
        let parts = |p: &Pat| match p {
            Pat::Tuple(t) => t.elems.iter().cloned().collect(),
            Pat::Slice(t) => t.elems.iter().cloned().collect(),
            _ => Vec::<Pat>::new(),
        };
        let values: Vec<Expr> = match strip(e) {
            Expr::Tuple(t) => t.elems.iter().cloned().collect(),
            Expr::Array(t) => t.elems.iter().cloned().collect(),
            Expr::If(i) if !parts(pat).is_empty() => {
                self.calls(&i.cond);
                let condition = self.value(&i.cond).to_string();
                self.statements(&i.then_branch, &condition);
                if let Some(e) = tail(&i.then_branch) {
                    self.bind(pat, &condition, e);
                }
                if let Some((_, e)) = &i.else_branch
                    && let Expr::Block(b) = &**e
                {
                    self.statements(&b.block, "");
                    if let Some(e) = tail(&b.block) {
                        self.bind(pat, "", e);
                    }
                }
                return;
            }
            _ => vec![],
        };
        let list = parts(pat);
        if !list.is_empty() && list.len() == values.len() {
            for (p, e) in list.iter().zip(&values) {
                self.bind(p, guard, e);
            }
            return;
        }
        match pat {
            Pat::Type(t) => self.bind(&t.pat, guard, e),
            Pat::Ident(i) => {
                let name = i.ident.to_string();
                if let Expr::Closure(c) = strip(e) {
                    if !self.closures.contains(&name) {
                        match &*c.body {
                            Expr::Block(b) => self.block(&b.block, guard, &name),
                            body => self.calls(body),
                        }
                    }
                    return;
                }
                let fixed = i.mutability.is_none();
                if let (true, Some(x), false) =
                    (fixed, self.value(e).value(), matches!(strip(e), Expr::If(_)))
                {
                    self.numbers.insert(name, x);
                    return;
                }
                if fixed {
                    self.numbers.remove(&name);
                }
                self.assign(&name, guard, e);
            }
            _ => {
                // Parts of a whole that is not taken apart here.
                self.calls(e);
                for name in named(pat) {
                    self.numbers.remove(&name);
                }
            }
        }
    }

    fn statements(&mut self, b: &syn::Block, guard: &str) {
        let last = tail(b).is_some();
        let count = b.stmts.len() - usize::from(last);
        for s in &b.stmts[..count] {
            self.statement(s, guard);
        }
    }

    fn block(&mut self, b: &syn::Block, guard: &str, name: &str) {
        self.statements(b, guard);
        if let Some(e) = tail(b) {
            if is_statement(e) && !matches!(e, Expr::If(i) if i.else_branch.is_some()) {
                self.expression(e, guard);
            } else {
                self.assign(name, guard, e);
            }
        }
    }

    fn statement(&mut self, s: &Stmt, guard: &str) {
        match s {
            Stmt::Local(l) => {
                if let Some(init) = &l.init {
                    self.bind(&l.pat, guard, &init.expr);
                }
            }
            Stmt::Expr(e, _) => self.expression(e, guard),
            _ => {}
        }
    }

    fn expression(&mut self, e: &Expr, guard: &str) {
        match e {
            Expr::ForLoop(f) => {
                self.calls(&f.expr);
                self.statements(&f.body, guard);
                if let Some(e) = tail(&f.body) {
                    self.expression(e, guard);
                }
            }
            Expr::While(w) => self.statements(&w.body, guard),
            Expr::If(i) => {
                self.calls(&i.cond);
                let condition = match &*i.cond {
                    Expr::Let(_) => "LAW".to_owned(),
                    c => self.value(c).to_string(),
                };
                self.statements(&i.then_branch, &condition);
                if let Some(e) = tail(&i.then_branch) {
                    self.expression(e, &condition);
                }
                match i.else_branch.as_ref().map(|(_, e)| &**e) {
                    Some(Expr::Block(b)) => self.statements(&b.block, ""),
                    Some(e) => self.expression(e, ""),
                    None => {}
                }
            }
            Expr::Assign(a) => match &*a.left {
                Expr::Tuple(t) => {
                    let names: Vec<Expr> = t.elems.iter().cloned().collect();
                    if let Expr::Tuple(values) = &*a.right {
                        for (n, v) in names.iter().zip(&values.elems) {
                            let name = self.value(n).to_string();
                            self.assign(&name, guard, v);
                        }
                    } else {
                        self.calls(&a.right);
                    }
                }
                left => {
                    let name = self.value(left).to_string();
                    self.assign(&name, guard, &a.right);
                }
            },
            Expr::Binary(b) => {
                let value =
                    |op: fn(Formula, Formula) -> Formula, r: &Self| op(r.value(&b.left), r.value(&b.right));
                let value = match b.op {
                    BinOp::AddAssign(_) => value(|a, b| a + b, self),
                    BinOp::SubAssign(_) => value(|a, b| a - b, self),
                    BinOp::MulAssign(_) => value(|a, b| a * b, self),
                    BinOp::BitXorAssign(_) => value(|a, b| Formula::call("ExclusiveOr", &[a, b]), self),
                    _ => return self.calls(e),
                };
                self.calls(e);
                let name = self.value(&b.left).to_string();
                self.put(&name, guard, &value);
            }
            Expr::Return(r) => {
                if let Some(e) = &r.expr {
                    self.assign("return", guard, e);
                }
            }
            e => self.calls(e),
        }
    }
}

fn strip(e: &Expr) -> &Expr {
    match e {
        Expr::Paren(p) => strip(&p.expr),
        Expr::Group(p) => strip(&p.expr),
        Expr::Reference(p) => strip(&p.expr),
        e => e,
    }
}

fn is_statement(e: &Expr) -> bool {
    matches!(e, Expr::If(_) | Expr::ForLoop(_) | Expr::While(_) | Expr::Loop(_) | Expr::Assign(_))
        || matches!(e, Expr::Binary(b) if matches!(b.op, BinOp::AddAssign(_) | BinOp::SubAssign(_) | BinOp::MulAssign(_) | BinOp::BitXorAssign(_)))
}

/// The expression that a block ends with.
fn tail(b: &syn::Block) -> Option<&Expr> {
    match b.stmts.last() {
        Some(Stmt::Expr(e, None)) => Some(e),
        _ => None,
    }
}

/// Numbers and named numbers of a function.
struct Numbers<'a, 'b> {
    reader: &'b Reader<'a>,
    all: BTreeSet<String>,
}

/// The value of an expression of nothing but numbers.
fn constant_value(e: &Expr) -> Option<f64> {
    let value = |e| constant_value(e);
    match e {
        Expr::Lit(l) => literal(&l.lit),
        Expr::Paren(p) => value(&p.expr),
        Expr::Cast(c) => value(&c.expr),
        Expr::Unary(u) => matches!(u.op, UnOp::Neg(_)).then(|| value(&u.expr))?.map(|x| -x),
        Expr::Binary(b) => {
            let (x, y) = (value(&b.left)?, value(&b.right)?);
            match b.op {
                BinOp::Add(_) => Some(x + y),
                BinOp::Sub(_) => Some(x - y),
                BinOp::Mul(_) => Some(x * y),
                BinOp::Div(_) => Some(x / y),
                _ => None,
            }
        }
        _ => None,
    }
}

impl<'ast> Visit<'ast> for Numbers<'_, '_> {
    fn visit_local(&mut self, l: &'ast syn::Local) {
        if name_of(&l.pat).is_some_and(|n| self.reader.closures.contains(&n))
            && l.init.as_ref().is_some_and(|i| matches!(&*i.expr, Expr::Closure(_)))
        {
            return;
        }
        syn::visit::visit_local(self, l);
    }

    fn visit_expr(&mut self, e: &'ast Expr) {
        if let Expr::Binary(_) | Expr::Unary(_) | Expr::Lit(_) = e
            && let Some(x) = constant_value(e)
        {
            self.all.insert(number(x.abs()));
            return;
        }
        match e {
            // Places, not numbers.
            Expr::Index(i) => return self.visit_expr(&i.expr),
            Expr::Repeat(r) => return self.visit_expr(&r.expr),
            Expr::Range(r) => {
                if let Some(x) = r.end.as_deref().and_then(constant_value) {
                    self.all.insert(number(x));
                }
                return;
            }
            Expr::Path(p) => {
                let name = p.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default();
                if self.reader.context.named.contains_key(&name) {
                    self.all.insert(name);
                } else if let Some(x) = self.reader.context.constants.get(&name) {
                    self.all.insert(number(*x));
                }
            }
            Expr::MethodCall(m) => {
                self.all.extend(constant(&m.method.to_string()).map(str::to_owned));
            }
            Expr::Field(f) => {
                let of_tables = matches!(&*f.base, Expr::Path(p) if p.path.is_ident("tables"));
                let name = match &f.member {
                    Member::Named(n) if of_tables => n.to_string().to_uppercase(),
                    _ => String::new(),
                };
                if ["NOISE", "FIXED", "STRAIN_LIMIT"].contains(&name.as_str()) {
                    self.all.insert(name);
                }
            }
            _ => {}
        }
        syn::visit::visit_expr(self, e);
    }
}
