#include "tests/client/ledger/ledger.h"

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include <fcntl.h>
#include <unistd.h>

namespace atlas::testing {
namespace {

// Calls back for each whole line; how many bytes they take.
template <typename OnLine>
std::size_t ForEachLine(std::string_view text, const OnLine& on_line) {
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) return begin;
    const std::string_view line = text.substr(begin, end - begin);
    if (line.ends_with(';')) on_line(line.substr(0, line.size() - 1));
    begin = end + 1;
  }
}

std::string TextFrom(const std::filesystem::path& file, std::uint64_t offset) {
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(offset));
  std::ostringstream text;
  if (in) text << in.rdbuf();
  return text.str();
}

std::optional<SessionAction> ActionOf(std::string_view word) {
  for (const SessionAction action : {SessionAction::kRetract, SessionAction::kRestore,
                                     SessionAction::kRelease, SessionAction::kPurge}) {
    if (word == WordOf(action)) return action;
  }
  return std::nullopt;
}

}  // namespace

std::string_view WordOf(SessionAction action) {
  switch (action) {
    case SessionAction::kRetract:
      return "retract";
    case SessionAction::kRestore:
      return "restore";
    case SessionAction::kRelease:
      return "release";
    case SessionAction::kPurge:
      return "purge";
    case SessionAction::kPublish:
      return "publish";
  }
  return "";
}

void LedgerState::Apply(std::string_view line) {
  const std::size_t space = std::min(line.find(' '), line.size());
  const std::string_view word = line.substr(0, space);
  const std::string_view rest = line.substr(std::min(space + 1, line.size()));
  std::istringstream numbers{std::string(rest)};
  if (word == "start" || word == "connected" || word == "lost") {
    if (word == "lost") in_flight_at_loss += in_flight;
    in_flight = 0;
  } else if (word == "wrong") {
    if (wrong.empty()) wrong = rest;
  } else if (word == "send") {
    ++in_flight;
  } else if (word == "sent") {
    --in_flight;
    for (auto& [id, frame] : frames) {
      frame.is_acknowledged = frame.is_acknowledged || frame.is_taken;
    }
  } else if (word == "move" || word == "moved") {
    ApplyToPoses(word, rest);
  } else if (word == "changed" || ActionOf(word)) {
    std::uint32_t session = 0;
    numbers >> session;
    ApplyToSession(word, session);
  } else {
    FrameId frame;
    numbers >> frame.session >> frame.sequence;
    ApplyToFrame(word, frame);
  }
}

void LedgerState::ApplyToFrame(std::string_view word, const FrameId& id) {
  Frame& frame = frames[id];
  sessions[id.session];
  if (word == "upload") {
    ++in_flight;
  } else if (word == "uploaded") {
    if (in_flight > 0) --in_flight;  // none: the handshake said so
    frame.is_acknowledged = true;
  } else if (word == "taken") {
    frame.is_taken = true;
  } else if (word != "put") {
    throw std::runtime_error("no word of a ledger: " + std::string(word));
  }
}

void LedgerState::ApplyToPoses(std::string_view word, std::string_view rest) {
  std::istringstream numbers{std::string(rest)};
  std::uint32_t version = 0;
  numbers >> version;
  Batch& batch = batches[version];
  if (word == "moved") {
    --in_flight;
    batch.is_acknowledged = true;
    return;
  }
  ++in_flight;
  batch.frames.clear();  // the same once more
  FrameId frame;
  char colon = 0;
  while (numbers >> frame.session >> colon >> frame.sequence) {
    batch.frames.push_back(frame);
  }
}

void LedgerState::ApplyToSession(std::string_view word, std::uint32_t number) {
  Session& session = sessions[number];
  if (word == "changed") {
    --in_flight;
    ++session_changes;
    session.done = session.asked.value();
    session.asked.reset();
  } else {
    ++in_flight;
    session.asked = ActionOf(word);
  }
}

Ledger::Ledger(const std::filesystem::path& file)
    : fd_(open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (fd_ < 0) throw std::runtime_error("cannot write " + file.string());
  ForEachLine(TextFrom(file, 0), [this](std::string_view line) { state_.Apply(line); });
  // What a kill cut short stays a line of its own.
  if (write(fd_, "\n", 1) != 1) throw std::runtime_error("cannot write " + file.string());
  Write("start");
}

Ledger::~Ledger() {
  close(fd_);
}

void Ledger::Write(const std::string& line) {
  const std::string text = line + ";\n";
  if (write(fd_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error("the ledger cannot be written");
  }
  state_.Apply(line);
}

LedgerState& LedgerReader::Read() {
  const std::string text = TextFrom(file_, offset_);
  offset_ += ForEachLine(text, [this](std::string_view line) { state_.Apply(line); });
  return state_;
}

}  // namespace atlas::testing
