#include "client/merge/source/keyframe_spool.h"

#include <cerrno>

#include "core/base/disk_error.h"

namespace atlas {
namespace {

tl::unexpected<Status> Failed(const char* what) {
  return Error(DiskError(what, "a temporary file", errno));
}

}  // namespace

Result<KeyframeSpool> KeyframeSpool::Create() {
  std::FILE* file = std::tmpfile();
  if (file == nullptr) return Failed("cannot create");
  return KeyframeSpool(file);
}

Result<std::size_t> KeyframeSpool::Add(ByteSpan blob) {
  std::FILE* file = file_.get();
  if (fseeko(file, end_, SEEK_SET) != 0) return Failed("cannot write");
  // Not with the null pointer that an empty blob may have.
  if (!blob.empty() && std::fwrite(blob.data(), 1, blob.size(), file) != blob.size()) {
    return Failed("cannot write");
  }
  places_.push_back({end_, blob.size()});
  end_ += static_cast<std::int64_t>(blob.size());
  return places_.size() - 1;
}

Result<Bytes> KeyframeSpool::Read(std::size_t number) {
  const Place& place = places_[number];
  Bytes blob(place.size);
  std::FILE* file = file_.get();
  // Seeking writes out what Add left in memory.
  if (fseeko(file, place.offset, SEEK_SET) != 0) return Failed("cannot write");
  if (!blob.empty() && std::fread(blob.data(), 1, blob.size(), file) != blob.size()) {
    return Failed("cannot read");
  }
  return blob;
}

}  // namespace atlas
