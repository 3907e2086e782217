//! Functions compiled in this crate.
//!
//! A generic function is compiled in the crate that calls it. The solver is generic over the dimension alone, and only
//! 1, 2 and 3 make sense: its coarse entrances lead to functions without generics, one for each dimension, so that a
//! user's program links the solver and does not compile it.

use std::any::Any;

/// A reference as one to another type, which is the same one once generics have been filled in.
pub(crate) fn same_ref<T: 'static, U: 'static>(value: &T) -> &U {
    (value as &dyn Any).downcast_ref().expect("one type for one dimension")
}

/// A value as one of another type, which is the same one once generics have been filled in.
pub(crate) fn same<T: 'static, U: 'static>(value: T) -> U {
    let mut value = Some(value);
    let value = (&mut value as &mut dyn Any).downcast_mut::<Option<U>>();
    value.and_then(Option::take).expect("one type for one dimension")
}

/// A block as three functions of this crate, one for each dimension, of which the one for `D` is called:
/// `compiled!(D: (generic: &Type<D> = value, …; other: Type = value, …) -> Type { … })`.
///
/// References to types that depend on the dimension stand first and get their types by name; other arguments follow
/// behind the semicolon.
macro_rules! compiled {
    ($d:ident: ($($of:ident: &$t:ty = $v:expr),+ $(; $($name:ident: $type:ty = $value:expr),+)?) -> $out:ty $body:block) => {{
        const { assert!($d >= 1 && $d <= 3, "bodies have one, two or three dimensions") };
        match $d {
            1 => $crate::compiled::compiled!(@ 1, $d, [$($of, $t, $v;)+] [$($($name, $type, $value;)+)?] $out, $body),
            2 => $crate::compiled::compiled!(@ 2, $d, [$($of, $t, $v;)+] [$($($name, $type, $value;)+)?] $out, $body),
            _ => $crate::compiled::compiled!(@ 3, $d, [$($of, $t, $v;)+] [$($($name, $type, $value;)+)?] $out, $body),
        }
    }};
    (@ $n:literal, $d:ident, [$($of:ident, $t:ty, $v:expr;)+] [$($name:ident, $type:ty, $value:expr;)*] $out:ty, $body:block) => {{
        const $d: usize = $n;
        #[inline(never)]
        fn instance($($of: &$t,)+ $($name: $type),*) -> $out $body
        $crate::compiled::same(instance($($crate::compiled::same_ref($v),)+ $($value),*))
    }};
}

pub(crate) use compiled;
