#define_import_path relief::trace
@library@
