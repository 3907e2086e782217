//! Energies by expressions: parsed once, evaluated with their first two derivatives.

use rkpm::material::{Distortion, InvariantEnergy};

/// What an expression does, on a stack.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Op {
    Number(f64),
    /// The excess of an invariant over 3.
    Excess(usize),
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Negate,
    Exp,
    Log,
    Sqrt,
}

/// An energy of the reduced invariants.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expression(Vec<Op>);

/// A value with its gradient and Hessian: w, w₁, w₂, w₁₁, w₁₂, w₂₂.
#[derive(Debug, Clone, Copy, Default)]
struct Jet([f64; 6]);

impl Jet {
    fn number(value: f64) -> Self {
        Jet([value, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// A function of this, by its value and first two derivatives.
    fn chain(self, value: f64, first: f64, second: f64) -> Self {
        let [_, a, b, aa, ab, bb] = self.0;
        Jet([
            value,
            first * a,
            first * b,
            first * aa + second * a * a,
            first * ab + second * a * b,
            first * bb + second * b * b,
        ])
    }

    fn plus(self, other: Self, sign: f64) -> Self {
        Jet(std::array::from_fn(|k| self.0[k] + sign * other.0[k]))
    }

    fn times(self, other: Self) -> Self {
        let ([x, a, b, aa, ab, bb], [y, c, d, cc, cd, dd]) = (self.0, other.0);
        Jet([
            x * y,
            a * y + x * c,
            b * y + x * d,
            aa * y + 2.0 * a * c + x * cc,
            ab * y + a * d + b * c + x * cd,
            bb * y + 2.0 * b * d + x * dd,
        ])
    }

    fn inverse(self) -> Self {
        let x = self.0[0];
        self.chain(1.0 / x, -1.0 / (x * x), 2.0 / (x * x * x))
    }

    fn exp(self) -> Self {
        let value = self.0[0].exp();
        self.chain(value, value, value)
    }

    fn log(self) -> Self {
        let x = self.0[0];
        self.chain(x.ln(), 1.0 / x, -1.0 / (x * x))
    }

    fn power(self, other: Self) -> Self {
        let x = self.0[0];
        // A constant exponent, with which the base may be zero or below.
        if other.0[1..].iter().all(|slope| *slope == 0.0) {
            let n = other.0[0];
            let slope = |factor: f64, power: f64| if factor == 0.0 { 0.0 } else { factor * x.powf(power) };
            return self.chain(x.powf(n), slope(n, n - 1.0), slope(n * (n - 1.0), n - 2.0));
        }
        other.times(self.log()).exp()
    }
}

impl InvariantEnergy for Expression {
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
        self.evaluate_excess(i1 - 3.0, i2 - 3.0)
    }

    fn evaluate_excess(&self, e1: f64, e2: f64) -> Distortion {
        let mut stack = [Jet::default(); DEPTH];
        let mut top = 0;
        for op in &self.0 {
            // What takes two takes the upper one off first.
            let (above, below) = (stack[top.max(1) - 1], top.max(2) - 2);
            match *op {
                Op::Number(value) => {
                    stack[top] = Jet::number(value);
                    top += 1;
                    continue;
                }
                Op::Excess(which) => {
                    let mut jet = Jet::number([e1, e2][which]);
                    jet.0[1 + which] = 1.0;
                    stack[top] = jet;
                    top += 1;
                    continue;
                }
                Op::Negate => stack[top - 1] = Jet::default().plus(above, -1.0),
                Op::Exp => stack[top - 1] = above.exp(),
                Op::Log => stack[top - 1] = above.log(),
                Op::Sqrt => stack[top - 1] = above.power(Jet::number(0.5)),
                Op::Add => stack[below] = stack[below].plus(above, 1.0),
                Op::Subtract => stack[below] = stack[below].plus(above, -1.0),
                Op::Multiply => stack[below] = stack[below].times(above),
                Op::Divide => stack[below] = stack[below].times(above.inverse()),
                Op::Power => stack[below] = stack[below].power(above),
            }
            if matches!(op, Op::Add | Op::Subtract | Op::Multiply | Op::Divide | Op::Power) {
                top -= 1;
            }
        }
        let [energy, w1, w2, w11, w12, w22] = stack[0].0;
        Distortion { energy, w1, w2, w11, w12, w22 }
    }
}

/// Most values that an expression keeps at a time.
const DEPTH: usize = 32;
/// Most brackets and signs within each other: they are read by recursion.
const NESTED: usize = 64;

impl Expression {
    /// Reads an expression of `I1`, `I2` and the constants.
    ///
    /// # Errors
    /// Where it is none, with the place and what it knows.
    pub(crate) fn parse(text: &str, constants: &[(String, f64)]) -> Result<Self, String> {
        let is_word = |name: &str| text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == name);
        let unused = |name: &str| ["I1", "I2", "exp", "log", "sqrt"].contains(&name) || !is_word(name);
        if let Some((name, _)) = constants.iter().find(|(name, _)| unused(name)) {
            return Err(format!("energy {text:?}: it has no constant {name}, leave it out"));
        }
        let mut parser = Parser { text, rest: text.trim_start(), constants, ops: Vec::new(), nested: 0 };
        parser.sum()?;
        if !parser.rest.is_empty() {
            return Err(parser.expected("an operator or the end"));
        }
        let mut ops = parser.ops;
        excesses(&mut ops);
        let mut depth = 0;
        for op in &ops {
            match op {
                Op::Number(_) | Op::Excess(_) => depth += 1,
                Op::Add | Op::Subtract | Op::Multiply | Op::Divide | Op::Power => depth -= 1,
                _ => {}
            }
            if depth > DEPTH {
                return Err(format!("energy {text:?}: keeps more than {DEPTH} values at a time, regroup it"));
            }
        }
        Ok(Expression(ops))
    }
}

/// Takes `I1 - 3` for the excess itself, which is known to full precision near rest.
fn excesses(ops: &mut Vec<Op>) {
    let mut k = 0;
    while k + 4 < ops.len() {
        if let [Op::Excess(which), Op::Number(a), Op::Add, Op::Number(b), Op::Subtract] = ops[k..k + 5]
            && a == 3.0
            && b == 3.0
        {
            ops.splice(k..k + 5, [Op::Excess(which)]);
        }
        k += 1;
    }
}

struct Parser<'a> {
    text: &'a str,
    rest: &'a str,
    constants: &'a [(String, f64)],
    ops: Vec<Op>,
    nested: usize,
}

impl Parser<'_> {
    fn expected(&self, what: &str) -> String {
        let at = self.text.len() - self.rest.len();
        format!("energy {:?}: expected {what} at character {}", self.text, 1 + self.text[..at].chars().count())
    }

    fn take(&mut self, token: &str) -> bool {
        let Some(rest) = self.rest.strip_prefix(token) else { return false };
        self.rest = rest.trim_start();
        true
    }

    fn sum(&mut self) -> Result<(), String> {
        self.product()?;
        loop {
            let op = match () {
                () if self.take("+") => Op::Add,
                () if self.take("-") => Op::Subtract,
                () => return Ok(()),
            };
            self.product()?;
            self.ops.push(op);
        }
    }

    fn product(&mut self) -> Result<(), String> {
        self.signed()?;
        loop {
            let op = match () {
                () if !self.rest.starts_with("**") && self.take("*") => Op::Multiply,
                () if self.take("/") => Op::Divide,
                () => return Ok(()),
            };
            self.signed()?;
            self.ops.push(op);
        }
    }

    fn signed(&mut self) -> Result<(), String> {
        self.nested += 1;
        if self.nested > NESTED {
            return Err(format!("energy {:?}: brackets and signs more than {NESTED} deep", self.text));
        }
        if self.take("-") {
            self.signed()?;
            self.ops.push(Op::Negate);
        } else if self.take("+") {
            self.signed()?;
        } else {
            self.power()?;
        }
        self.nested -= 1;
        Ok(())
    }

    fn power(&mut self) -> Result<(), String> {
        self.atom()?;
        if self.take("**") || self.take("^") {
            self.signed()?;
            self.ops.push(Op::Power);
        }
        Ok(())
    }

    fn atom(&mut self) -> Result<(), String> {
        if self.take("(") {
            self.sum()?;
            return if self.take(")") { Ok(()) } else { Err(self.expected("\")\"")) };
        }
        let word: String = self.rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        if word.starts_with(|c: char| c.is_alphabetic() || c == '_') {
            return self.named(&word);
        }
        let digits = number_length(self.rest);
        let Ok(value) = self.rest[..digits].parse::<f64>() else {
            return Err(self.expected("a number, a name or \"(\""));
        };
        self.rest = self.rest[digits..].trim_start();
        self.ops.push(Op::Number(value));
        Ok(())
    }

    fn named(&mut self, word: &str) -> Result<(), String> {
        let function = match word {
            "exp" => Some(Op::Exp),
            "log" => Some(Op::Log),
            "sqrt" => Some(Op::Sqrt),
            _ => None,
        };
        if let Some(function) = function {
            self.take(word);
            if !self.take("(") {
                return Err(self.expected("\"(\""));
            }
            self.sum()?;
            if !self.take(")") {
                return Err(self.expected("\")\""));
            }
            self.ops.push(function);
            return Ok(());
        }
        match (word, self.constants.iter().find(|(name, _)| name == word)) {
            ("I1" | "I2", _) => {
                self.ops.extend([Op::Excess(usize::from(word == "I2")), Op::Number(3.0), Op::Add]);
            }
            (_, Some((_, value))) => self.ops.push(Op::Number(*value)),
            _ => {
                let known = self.constants.iter().map(|(name, _)| format!(", {name}")).collect::<String>();
                return Err(format!("energy {:?}: what is {word}? Known are I1, I2{known}, exp, log, sqrt", self.text));
            }
        }
        self.take(word);
        Ok(())
    }
}

/// How many bytes at the beginning are a number.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digit = |k: usize| bytes.get(k).is_some_and(u8::is_ascii_digit);
    let mut end = 0;
    while digit(end) || bytes.get(end) == Some(&b'.') {
        end += 1;
    }
    if end > 0 && matches!(bytes.get(end), Some(b'e' | b'E')) {
        let signed = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if digit(signed) {
            end = signed;
            while digit(end) {
                end += 1;
            }
        }
    }
    end
}
