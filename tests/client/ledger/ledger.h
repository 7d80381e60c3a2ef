// A vehicle's ledger: what it was about to ask, written before it asked, and what it was answered,
// written before it did anything else. A file of lines, each with a ';' at its end: one that a kill
// cut short does not count. It outlives the process, not the machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/session_action.h"
#include "tests/client/ledger/fleet_frames.h"

namespace atlas::testing {

std::string_view WordOf(SessionAction action);

// What the lines say. The words:
//   start | connected | lost       of the process, of its connection
//   upload S N | uploaded S N      of the daemon
//   put S N | taken S N            of the spool
//   send | sent                    all that the spool has; it is empty
//   move V S:N S:N ... | moved V   poses, to version V
//   retract S | restore S | release S | purge S | changed S
//   wrong WORDS                    an answer that there must not be
struct LedgerState {
  struct Frame {
    bool is_taken = false;         // by the spool
    bool is_acknowledged = false;  // by the daemon
  };
  struct Batch {
    std::vector<FrameId> frames;
    bool is_acknowledged = false;
  };
  struct Session {
    std::optional<SessionAction> done;   // the last one that was acknowledged
    std::optional<SessionAction> asked;  // and not answered yet

    bool may_be_purged() const {
      return done == SessionAction::kPurge || asked == SessionAction::kPurge;
    }
  };

  std::map<FrameId, Frame> frames;
  std::map<std::uint32_t, Batch> batches;  // by version, in the order in which they were asked for
  std::map<std::uint32_t, Session> sessions;
  std::uint64_t session_changes = 0;  // acknowledged
  std::string wrong;
  std::size_t in_flight = 0;          // on the connection that there is
  std::size_t in_flight_at_loss = 0;  // on those that were lost; whoever counts them sets it to 0

  void Apply(std::string_view line);

 private:
  void ApplyToFrame(std::string_view word, const FrameId& id);
  void ApplyToPoses(std::string_view word, std::string_view rest);
  void ApplyToSession(std::string_view word, std::uint32_t number);
};

class Ledger {
 public:
  // Reads what earlier processes wrote; the next line begins a new one.
  explicit Ledger(const std::filesystem::path& file);
  ~Ledger();
  Ledger(const Ledger&) = delete;
  Ledger& operator=(const Ledger&) = delete;
  Ledger(Ledger&&) = delete;
  Ledger& operator=(Ledger&&) = delete;

  void Write(const std::string& line);
  const LedgerState& state() const { return state_; }

 private:
  LedgerState state_;
  int fd_ = -1;
};

// The ledger of another process, as far as it is written.
class LedgerReader {
 public:
  explicit LedgerReader(std::filesystem::path file) : file_(std::move(file)) {}

  // What is new since the last call.
  LedgerState& Read();

 private:
  std::filesystem::path file_;
  std::uint64_t offset_ = 0;
  LedgerState state_;
};

}  // namespace atlas::testing
