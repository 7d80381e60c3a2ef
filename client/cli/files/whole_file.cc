#include "client/cli/files/whole_file.h"

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>

#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// errno of the failing call, 0 when the bytes are in the file.
int WriteBytes(const std::filesystem::path& path, ByteSpan bytes) {
  errno = 0;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (file.good()) return 0;
  return errno != 0 ? errno : EIO;
}

}  // namespace

Status MakeDirectory(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  return error ? DiskError("cannot make folder", directory, error.value()) : Status();
}

Status CheckPlace(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (::access((folder / ".").c_str(), W_OK) != 0) return DiskError("cannot write", path, errno);
  if (std::filesystem::is_directory(path, error)) return DiskError("cannot write", path, EISDIR);
  return {};
}

Status WriteWholeFile(const std::filesystem::path& path, ByteSpan bytes) {
  std::filesystem::path partial = path;
  partial += ".partial";
  std::error_code error;
  int failed = WriteBytes(partial, bytes);
  if (failed == 0) {
    std::filesystem::rename(partial, path, error);
    failed = error.value();
  }
  if (failed == 0) return {};
  std::filesystem::remove(partial, error);
  return DiskError("cannot write", path, failed);
}

Status WriteTextFile(const std::filesystem::path& path, std::string_view text) {
  return WriteWholeFile(path,
                        ByteSpan(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

Result<std::string> ReadWholeFile(const std::filesystem::path& path, std::uint64_t max_bytes) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return Error(StatusCode::kInvalidData, StrCat(path.string(), ": a folder, expected a file"));
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text;
  std::array<char, 1 << 16> block{};
  while (file.good() && text.size() <= max_bytes) {  // a pipe does not say its size
    file.read(block.data(), block.size());
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (text.size() > max_bytes) {
    return Error(StatusCode::kResourceExhausted,
                 StrCat(path.string(), ": more than ", max_bytes, " bytes"));
  }
  if (!file.eof()) return Error(DiskError("cannot read", path, errno != 0 ? errno : EIO));
  return text;
}

}  // namespace atlas
