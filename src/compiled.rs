//! Functions compiled in this crate.
//!
//! A generic function is compiled in the crate that calls it. Scenes are generic over the dimension alone, and only
//! 1, 2 and 3 make sense: their coarse entrances lead to functions without generics, one for each dimension, so that a
//! user's program links them and does not compile them. Models know their dimension at run time alone; their inner loops are compiled for
//! each dimension too.

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

/// A block for a dimension that is known at run time alone, with a constant of that name in it: `by_dim!(dim, D => …)`. For inner loops
/// over components, which a compiler unrolls.
macro_rules! by_dim {
    ($dim:expr, $d:ident => $body:expr) => {
        match $dim {
            1 => {
                const $d: usize = 1;
                $body
            }
            2 => {
                const $d: usize = 2;
                $body
            }
            _ => {
                const $d: usize = 3;
                $body
            }
        }
    };
}

pub(crate) use by_dim;
pub(crate) use compiled;
