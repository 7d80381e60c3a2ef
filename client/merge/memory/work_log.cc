#include "client/merge/memory/work_log.h"

#include <cerrno>
#include <limits>
#include <utility>

#include <unistd.h>

#include "client/vehicle/stored_file.h"
#include "core/base/disk_error.h"
#include "core/base/hash.h"

namespace atlas {
namespace {

constexpr std::size_t kLengthBytes = 4;

// Bytes of all records that are whole.
std::size_t ReadRecords(ByteSpan bytes, const std::function<bool(ByteSpan)>& on_record) {
  ByteReader in(bytes);
  std::size_t whole = 0;
  while (in.remaining() > 0) {
    const std::uint32_t size = in.U32();
    const ByteSpan record = in.Raw(size);
    const std::uint64_t hash = in.U64();
    if (!in.ok() || Hash64(record) != hash || !on_record(record)) break;
    whole = in.position();
  }
  return whole;
}

}  // namespace

Result<WorkLog> WorkLog::Open(const std::filesystem::path& file,
                              const std::function<bool(ByteSpan)>& on_record) {
  const auto bytes = LoadFile(file, std::numeric_limits<std::uint64_t>::max());
  if (!bytes && bytes.error().code() != StatusCode::kNotFound) return Error(bytes.error());
  const std::size_t whole = bytes ? ReadRecords(*bytes, on_record) : 0;
  if (bytes && whole < bytes->size() && truncate(file.c_str(), static_cast<off_t>(whole)) != 0) {
    return Error(DiskError("cannot cut", file, errno));
  }
  std::FILE* const opened = std::fopen(file.c_str(), "ab");
  if (opened == nullptr) return Error(DiskError("cannot write", file, errno));
  return WorkLog(opened, file);
}

Status WorkLog::Append(ByteSpan record) {
  ByteWriter framed;
  framed.Reserve(kLengthBytes + record.size() + sizeof(std::uint64_t));
  framed.U32(static_cast<std::uint32_t>(record.size()));
  framed.Raw(record);
  framed.U64(Hash64(record));
  const Bytes& bytes = framed.bytes();
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
    return DiskError("cannot write", path_, errno);
  }
  return {};
}

}  // namespace atlas
