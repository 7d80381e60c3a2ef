#include "tests/fuzz/support/scratch_folder.h"

#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>

#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

namespace fs = std::filesystem;

fs::path Root() {
  std::error_code error;
  const fs::path memory = "/dev/shm";
  return fs::is_directory(memory, error) ? memory : fs::temp_directory_path();
}

}  // namespace

ScratchFolder::ScratchFolder() {
  std::string name = (Root() / "atlas_fuzz_XXXXXX").string();
  Require(mkdtemp(name.data()) != nullptr, "there is a folder to write to");
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

fs::path ScratchFolder::Write(const fs::path& name, ByteSpan content) const {
  fs::path path = path_ / name;
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << TextOf(content);
  out.close();
  Require(out.good(), "the scratch file is written");
  return path;
}

}  // namespace atlas::fuzz
