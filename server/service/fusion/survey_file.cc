#include "server/service/fusion/survey_file.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMagic = 0x3130'5652'5553'4152;  // "RASURV01"
constexpr std::size_t kHashBytes = 8;  // at the header's end, of the rest of it and of the payload
constexpr std::size_t kHeaderBytes = 64;

Result<Bytes> ReadWhole(const fs::path& path,
                        std::size_t max_bytes = std::numeric_limits<std::size_t>::max()) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) {
    return Error(StatusCode::kNotFound, StrCat(path.string(), ": ", error.message()));
  }
  Bytes bytes(static_cast<std::size_t>(std::min<std::uintmax_t>(size, max_bytes)));
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) {
    return Error(StatusCode::kUnavailable, StrCat("cannot read ", path.string()));
  }
  return bytes;
}

std::error_code LastError() {
  return {errno, std::generic_category()};
}

bool WriteAll(int fd, ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) {
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
  return true;
}

std::error_code WriteParts(const fs::path& path, std::initializer_list<ByteSpan> parts) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) {
    return LastError();
  }
  const bool is_written =
      std::all_of(parts.begin(), parts.end(), [fd](ByteSpan part) { return WriteAll(fd, part); }) &&
      ::fdatasync(fd) == 0;
  const std::error_code error = is_written ? std::error_code() : LastError();
  ::close(fd);
  return error;
}

Bytes Encode(const SurveyFileHeader& header) {
  ByteWriter out;
  out.U64(kMagic);
  out.U64(header.build);
  out.Raw(header.start);
  out.U64(header.revision);
  out.U64(header.key);
  out.U64(header.payload_bytes);
  return out.Take();
}

std::optional<SurveyFileHeader> Decode(ByteSpan bytes) {
  ByteReader in(bytes);
  SurveyFileHeader header;
  const bool is_ours = in.U64() == kMagic;
  header.build = in.U64();
  const ByteSpan start = in.Raw(header.start.size());
  header.revision = in.U64();
  header.key = in.U64();
  header.payload_bytes = in.U64();
  if (!is_ours || !in.ok()) {
    return std::nullopt;
  }
  std::copy(start.begin(), start.end(), header.start.begin());
  return header;
}

Bytes HashOf(ByteSpan head, ByteSpan payload) {
  ByteWriter out;
  out.U64(Hash64(head) ^ Hash64(payload));
  return out.Take();
}

}  // namespace

std::uint64_t BuildHash() {
  static const std::uint64_t kHash = [] {
    const auto program = ReadWhole("/proc/self/exe");
    return program ? Hash64(*program) : 0;
  }();
  return kHash;
}

std::size_t SurveyFileBytes(const SurveyFileHeader& header) {
  return kHeaderBytes + static_cast<std::size_t>(header.payload_bytes);
}

std::optional<SurveyFileHeader> ReadSurveyFileHeader(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  const auto bytes = ReadWhole(path, kHeaderBytes);
  const auto header = bytes ? Decode(*bytes) : std::nullopt;
  const bool is_whole =
      header && !error && size >= kHeaderBytes && header->payload_bytes == size - kHeaderBytes;
  return is_whole ? header : std::nullopt;
}

std::optional<Bytes> ReadSurveyFile(const fs::path& path, const SurveyFileHeader& expected) {
  if (ReadSurveyFileHeader(path) != expected) {  // before room is made for whatever is there
    return std::nullopt;
  }
  auto bytes = ReadWhole(path, SurveyFileBytes(expected));
  if (!bytes || bytes->size() != SurveyFileBytes(expected)) {
    return std::nullopt;
  }
  const ByteSpan head = ByteSpan(*bytes).first(kHeaderBytes - kHashBytes);
  const ByteSpan hash = ByteSpan(*bytes).subspan(head.size(), kHashBytes);
  const ByteSpan payload = ByteSpan(*bytes).subspan(kHeaderBytes);
  const Bytes right = HashOf(head, payload);
  if (Decode(head) != expected || !std::equal(hash.begin(), hash.end(), right.begin())) {
    return std::nullopt;
  }
  bytes->erase(bytes->begin(), bytes->begin() + kHeaderBytes);
  return *std::move(bytes);
}

Status WriteSurveyFile(const fs::path& path,
                       const fs::path& unfinished,
                       const SurveyFileHeader& header,
                       ByteSpan payload) {
  const Bytes head = Encode(header);
  std::error_code error = WriteParts(unfinished, {head, HashOf(head, payload), payload});
  if (!error) {
    fs::rename(unfinished, path, error);
  }
  if (!error) {
    return {};
  }
  std::error_code ignored;
  fs::remove(unfinished, ignored);
  return Status(StatusCode::kUnavailable,
                StrCat("cannot write ", path.string(), ": ", error.message()));
}

}  // namespace atlas
