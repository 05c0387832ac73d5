# Writes OUTPUT: a C++ file that defines `embedded_<SYMBOL>()`, the texts of FILES by file name (kernels/base/embedded.h).
set(body "")
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(READ ${file} hex HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(MAKE_C_IDENTIFIER ${name} id)
  string(APPEND arrays "constexpr unsigned char k_${id}[] = {${bytes}0};\n")
  string(APPEND body "    {\"${name}\", {reinterpret_cast<const char*>(k_${id}), sizeof(k_${id}) - 1}},\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"kernels/base/embedded.h\"\n\nnamespace {\n${arrays}}  // namespace\n\n"
  "namespace reliefbench {\nconst std::vector<EmbeddedFile>& embedded_${SYMBOL}() {\n"
  "  static const std::vector<EmbeddedFile> files = {\n${body}  };\n  return files;\n}\n}  // namespace reliefbench\n")
