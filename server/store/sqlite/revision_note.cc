#include "server/store/sqlite/revision_note.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <tuple>

#include <fcntl.h>
#include <unistd.h>

#include "core/base/bytes.h"
#include "core/base/hash.h"

namespace atlas {
namespace {

constexpr std::uint64_t kMagic = 0x3130'5645'5241'4152;  // "RAAREV01"
constexpr std::size_t kHashBytes = 8;                    // at the end, of the rest
constexpr std::size_t kNoteBytes = 48;
constexpr std::uint64_t kMaxRevision = std::uint64_t{1} << 62;  // the store has signed numbers

Bytes Encode(const NotedRevision& noted) {
  ByteWriter writer;
  writer.U64(kMagic);
  writer.Raw(noted.atlas_id);
  writer.U64(noted.epoch);
  writer.U64(noted.revision);
  writer.U64(Hash64(writer.bytes()));
  return writer.Take();
}

}  // namespace

bool NotedRevision::IsBeyond(const StoreIdentity& identity, std::uint64_t at) const {
  return atlas_id == identity.atlas_id && std::tie(epoch, revision) > std::tie(identity.epoch, at);
}

std::filesystem::path NoteOf(const std::filesystem::path& database) {
  return database.string() + "-revision";
}

std::optional<NotedRevision> ReadRevisionNote(const std::filesystem::path& file) {
  Bytes bytes(kNoteBytes);
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!in) {
    return std::nullopt;
  }
  ByteReader reader(bytes);
  const bool is_note = reader.U64() == kMagic;
  NotedRevision noted;
  const ByteSpan id = reader.Raw(noted.atlas_id.size());
  std::copy(id.begin(), id.end(), noted.atlas_id.begin());
  noted.epoch = reader.U64();
  noted.revision = reader.U64();
  const std::uint64_t hash = Hash64(ByteSpan(bytes).first(kNoteBytes - kHashBytes));
  const bool is_whole = is_note && reader.U64() == hash && noted.epoch < kMaxRevision &&
                        noted.revision < kMaxRevision;
  return is_whole ? std::optional(noted) : std::nullopt;
}

PlaceInLine PlaceOf(const std::optional<NotedRevision>& noted, const StoreIdentity& identity) {
  return noted && noted->atlas_id == identity.atlas_id ? PlaceInLine{noted->epoch, noted->revision}
                                                       : PlaceInLine{};
}

RevisionNote::RevisionNote(const std::filesystem::path& file, const StoreIdentity& identity)
    : noted_{identity.atlas_id, identity.epoch, 0},
      fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644)) {}

RevisionNote::~RevisionNote() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

void RevisionNote::Write(std::uint64_t revision) {
  noted_.revision = revision;
  const Bytes bytes = Encode(noted_);
  [[maybe_unused]] const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), 0);
}

}  // namespace atlas
