#include "client/connection/name_lookup.h"

#include <array>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

bool IsAddress(const std::string& host) {
  in_addr v4{};
  in6_addr v6{};
  const std::string without_scope = host.substr(0, host.find('%'));
  return inet_pton(AF_INET, host.c_str(), &v4) == 1 ||
         inet_pton(AF_INET6, without_scope.c_str(), &v6) == 1;
}

}  // namespace

struct NameLookup::Question {
  explicit Question(std::string asked) : host(std::move(asked)) {}

  const std::string host;
  std::mutex mutex;
  std::condition_variable is_answered;
  std::optional<Result<Addresses>> answer;
};

Result<NameLookup::Addresses> NameLookup::AskSystem(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failure = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (failure != 0) return Error(StatusCode::kUnavailable, gai_strerror(failure));
  Addresses addresses;
  for (const addrinfo* entry = found; entry != nullptr; entry = entry->ai_next) {
    std::array<char, NI_MAXHOST> text{};
    const int unnamed = getnameinfo(entry->ai_addr, entry->ai_addrlen, text.data(), text.size(),
                                    nullptr, 0, NI_NUMERICHOST);
    if (unnamed == 0) addresses.emplace_back(text.data());
  }
  freeaddrinfo(found);
  if (addresses.empty()) return Error(StatusCode::kUnavailable, "it has no address");
  return addresses;
}

NameLookup::NameLookup(Resolver resolver) : resolver_(std::move(resolver)) {}

Status NameLookup::Ask(const std::string& host) {
  auto question = std::make_shared<Question>(host);
  try {
    std::thread([question, resolver = resolver_] {
      Result<Addresses> answer = resolver(question->host);
      const std::lock_guard lock(question->mutex);
      question->answer = std::move(answer);
      question->is_answered.notify_all();
    }).detach();
  } catch (const std::system_error& failure) {
    return {StatusCode::kUnavailable, StrCat("no thread to look it up: ", failure.what())};
  }
  question_ = std::move(question);
  return {};
}

Result<std::optional<NameLookup::Addresses>> NameLookup::Find(
    const std::string& host, std::chrono::steady_clock::time_point latest) {
  if (IsAddress(host)) return Addresses{host};
  while (true) {
    if (question_ == nullptr) {
      if (Status status = Ask(host); !status.ok()) return Error(std::move(status));
    }
    const std::shared_ptr<Question> question = question_;
    std::unique_lock lock(question->mutex);
    const auto is_there = [&question] {
      return question->answer.has_value();
    };
    if (!question->is_answered.wait_until(lock, latest, is_there)) return std::nullopt;
    question_ = nullptr;
    if (question->host != host) continue;
    if (!*question->answer) return Error(question->answer->error());
    return **std::move(question->answer);
  }
}

}  // namespace atlas
