// Which atlas a spool sent to last, in a file beside its keyframes (docs/formats/vehicle.md): that
// the atlas was restored, or made anew, is noticed by the next run of the program, too. One thread
// at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "client/connection/requests.h"
#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

inline constexpr std::string_view kSentAtlasFileName = "sent";

class SentAtlas {
 public:
  // Reads nothing yet. The folder is there.
  explicit SentAtlas(const std::filesystem::path& folder);

  // Before anything is sent to it. True: what was sent to last is another atlas, or this one before
  // it was restored. Where nothing says what that was, it is this one from now on.
  bool IsAnother(const AtlasIdentity& atlas);
  // It was sent to, and whoever has to know that it is another one does.
  void Note(const AtlasIdentity& atlas);
  // What was wrong with the file since this was asked last: kInvalidData for one that is damaged,
  // which counts as none; else what the disk said. It stays as it is where it cannot be read now.
  Status TakeProblem();

 private:
  struct State {
    Bytes atlas_id;
    std::uint64_t epoch = 0;
    friend bool operator==(const State&, const State&) = default;
  };

  // nullopt for a daemon that does not say which atlas it has.
  static std::optional<State> StateOf(const AtlasIdentity& atlas);
  static Bytes Encode(const State& state);
  static Result<State> Decode(ByteSpan file);
  void Read();

  std::filesystem::path path_;
  bool is_read_ = false;  // or known to be of no use
  std::optional<State> last_;
  Status problem_;
};

}  // namespace atlas
