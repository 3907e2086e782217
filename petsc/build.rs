//! Finds PETSc and MPI by pkg-config.

fn main() {
    println!("cargo::rerun-if-env-changed=PKG_CONFIG_PATH");
    // Debian names the package of real numbers `PETSc`; the library of MPI is linked on its own, because this crate calls it too.
    for (package, debian) in [("PETSc", "libpetsc-real-dev"), ("ompi-c", "libopenmpi-dev")] {
        if let Err(error) = pkg_config::Config::new().probe(package) {
            panic!(
                "rkpm-petsc needs {package}, which pkg-config does not find.\n\
                 On Debian and Ubuntu: apt-get install {debian} pkg-config\n\
                 Elsewhere: let PKG_CONFIG_PATH name the folder with {package}.pc (PETSc 3.18 or later with 32-bit \
                 indices, real numbers and MUMPS; Open MPI).\n{error}"
            );
        }
    }
}
