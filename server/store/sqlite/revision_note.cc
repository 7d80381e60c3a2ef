#include "server/store/sqlite/revision_note.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <tuple>

#include <fcntl.h>
#include <unistd.h>

#include "core/base/bytes.h"
#include "core/base/hash.h"
#include "server/store/sqlite/connection/log_pages.h"

namespace atlas {
namespace {

constexpr std::uint64_t kMagic = 0x3230'5645'5241'4152;            // "RAAREV02"
constexpr std::uint64_t kMagicOfVersion1 = 0x3130'5645'5241'4152;  // "RAAREV01": without the log
constexpr std::size_t kHashBytes = 8;                              // at the end, of the rest
constexpr std::size_t kNoteBytes = 64;
constexpr std::size_t kNoteBytesOfVersion1 = 48;
constexpr std::uint64_t kMaxRevision = std::uint64_t{1} << 62;  // the store has signed numbers

Bytes Encode(const NotedRevision& noted) {
  ByteWriter writer;
  writer.U64(kMagic);
  writer.Raw(noted.atlas_id);
  writer.U64(noted.epoch);
  writer.U64(noted.revision);
  writer.U64(noted.log.salts);
  writer.U64(noted.log.revision);
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
  const auto found = static_cast<std::size_t>(in.gcount());
  ByteReader reader(bytes);
  const std::uint64_t magic = reader.U64();
  const std::size_t expected = magic == kMagicOfVersion1 ? kNoteBytesOfVersion1 : kNoteBytes;
  if (found < expected) {
    return std::nullopt;
  }
  NotedRevision noted;
  const ByteSpan id = reader.Raw(noted.atlas_id.size());
  std::copy(id.begin(), id.end(), noted.atlas_id.begin());
  noted.epoch = reader.U64();
  noted.revision = reader.U64();
  if (magic == kMagic) {
    noted.log.salts = reader.U64();
    noted.log.revision = reader.U64();
  }
  const std::uint64_t hash = Hash64(ByteSpan(bytes).first(expected - kHashBytes));
  const bool is_note = magic == kMagic || magic == kMagicOfVersion1;
  const bool is_whole = is_note && reader.U64() == hash && noted.epoch < kMaxRevision &&
                        noted.revision < kMaxRevision;
  return is_whole ? std::optional(noted) : std::nullopt;
}

PlaceInLine PlaceOf(const std::optional<NotedRevision>& noted, const StoreIdentity& identity) {
  return noted && noted->atlas_id == identity.atlas_id ? PlaceInLine{noted->epoch, noted->revision}
                                                       : PlaceInLine{};
}

RevisionNote::RevisionNote(const std::filesystem::path& database,
                           const StoreIdentity& identity,
                           const LogStart& log,
                           std::uint64_t revision)
    : noted_{identity.atlas_id, identity.epoch, revision, log},
      fd_(::open(NoteOf(database).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644)),
      log_fd_(::open((database.string() + "-wal").c_str(), O_RDONLY | O_CLOEXEC)) {}

RevisionNote::~RevisionNote() {
  for (const int fd : {fd_, log_fd_}) {
    if (fd >= 0) {
      ::close(fd);
    }
  }
}

void RevisionNote::Write(std::uint64_t revision) {
  const std::uint64_t salts = ReadLogSalts(log_fd_);
  if (salts != noted_.log.salts) {
    noted_.log = {salts, noted_.revision};
  }
  noted_.revision = revision;
  const Bytes bytes = Encode(noted_);
  [[maybe_unused]] const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), 0);
}

}  // namespace atlas
