// Keyframes' blobs in a temporary file without a name, while a merge reads them again and again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// One thread at a time.
class KeyframeSpool {
 public:
  // kResourceExhausted, kPermissionDenied: there can be no such file.
  static Result<KeyframeSpool> Create();

  // Its number: 0, 1, ... kResourceExhausted: the disk is full.
  Result<std::size_t> Add(ByteSpan blob);
  // Requires a number that Add gave.
  Result<Bytes> Read(std::size_t number);

 private:
  struct FileCloser {
    void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
  };
  struct Place {
    std::int64_t offset = 0;
    std::size_t size = 0;
  };

  explicit KeyframeSpool(std::FILE* file) : file_(file) {}

  std::unique_ptr<std::FILE, FileCloser> file_;
  std::vector<Place> places_;
  std::int64_t end_ = 0;
};

}  // namespace atlas
