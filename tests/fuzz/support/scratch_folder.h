// A folder of the process's own for readers of files, gone with it. In memory where the system has
// such a place: a fuzzer writes thousands of files a second.
#pragma once

#include <filesystem>
#include <string_view>

#include "core/base/bytes.h"

namespace atlas::fuzz {

class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ScratchFolder(ScratchFolder&&) = delete;
  ScratchFolder& operator=(ScratchFolder&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  // The path of the file, with this content in place of any other.
  std::filesystem::path Write(const std::filesystem::path& name, ByteSpan content) const;

 private:
  std::filesystem::path path_;
};

}  // namespace atlas::fuzz
