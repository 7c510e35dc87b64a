//! Closed sets of values that are read by their names.

/// Reads values of a type by the `name` of those in its list, and declares the error for other names, whose message begins
/// with `$there_is_none`.
macro_rules! read_by_name {
    ($type:ident :: $list:ident, $error:ident, $there_is_none:literal) => {
        #[doc = concat!("A name that none of [`", stringify!($type), "::", stringify!($list), "`] has.")]
        #[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
        #[error("{} {name:?}; known are {}", $there_is_none, $type::$list.map($type::name).join(", "))]
        pub struct $error {
            /// The given name.
            pub name: String,
        }

        impl std::str::FromStr for $type {
            type Err = $error;

            fn from_str(name: &str) -> Result<Self, $error> {
                let found = Self::$list.into_iter().find(|value| value.name() == name);
                found.ok_or_else(|| $error { name: name.to_owned() })
            }
        }
    };
}

pub(crate) use read_by_name;
