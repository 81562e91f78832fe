#include "core/mpi.hpp"

#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>
#include <thread>
#include <utility>

namespace hemowalk::mpi {

namespace {

constexpr std::size_t piece = std::size_t{1} << 30;  ///< MPI counts are int: longer data go in pieces
constexpr int gather_tag = 1, scatter_tag = 2;       ///< on the communicator of collective calls

/// Whether a launcher started this process: Open MPI's mpirun, or a resource manager through PMIx or PMI.
bool launched() {
  return std::getenv("OMPI_COMM_WORLD_SIZE") || std::getenv("PMIX_RANK") || std::getenv("PMI_RANK");
}

bool running() {
  int started = 0, finished = 0;
  MPI_Initialized(&started);
  MPI_Finalized(&finished);
  return started && !finished;
}

}  // namespace

int start() {
  if (!launched()) return 0;
  if (!running()) {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  }
  return world_rank();
}

void finish() {
  if (running()) MPI_Finalize();
}

int world_rank() {
  int rank = 0;
  if (running()) MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

struct Ranks::Impl {
  int rank = 0, count = 1;
  MPI_Comm messages = MPI_COMM_NULL, collective = MPI_COMM_NULL, errors = MPI_COMM_NULL;
  std::vector<std::byte> told;  ///< the error this rank told the others
  bool failed = false;          ///< told or heard of an error: nobody waits any more
  std::string heard;            ///< the error another rank told: every later wait throws it again
  Exit heard_code = Exit::internal;

  explicit Impl(MPI_Comm comm) {
    if (comm == MPI_COMM_NULL) return;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &count);
    for (MPI_Comm* c : {&messages, &collective, &errors}) MPI_Comm_dup(comm, c);
  }
  ~Impl() {
    if (!running() || failed) return;
    for (MPI_Comm* c : {&messages, &collective, &errors})
      if (*c != MPI_COMM_NULL) MPI_Comm_free(c);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Throws the error of another rank, if one was told.
  void listen() {
    if (!heard.empty()) throw Error(heard_code, heard);
    int there = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, errors, &there, &status);
    if (!there) return;
    int length = 0;
    MPI_Get_count(&status, MPI_CHAR, &length);
    std::string text(static_cast<std::size_t>(length), '\0');
    MPI_Recv(text.data(), length, MPI_CHAR, status.MPI_SOURCE, status.MPI_TAG, errors, MPI_STATUS_IGNORE);
    failed = true;
    heard = text, heard_code = static_cast<Exit>(status.MPI_TAG);
    throw Error(heard_code, heard);
  }

  void tell(Exit code, const std::string& text) {
    if (count == 1 || failed) return;
    failed = true;
    told.resize(text.size());
    std::memcpy(told.data(), text.data(), text.size());
    for (int r = 0; r < count; ++r) {
      if (r == rank) continue;
      MPI_Request request;
      MPI_Isend(told.data(), static_cast<int>(told.size()), MPI_CHAR, r, static_cast<int>(code), errors,
                &request);
      MPI_Request_free(&request);
    }
  }

  template <class Done>
  void poll(const Done& done) {
    for (int idle = 0; !done(); ++idle) {
      listen();
      if (idle > 200) std::this_thread::yield();  // more processes than cores
      if (idle > 20000)
        std::this_thread::sleep_for(std::chrono::microseconds(50));  // one rank is at work alone
    }
  }
  void complete(MPI_Request request) {
    poll([&] {
      int done = 0;
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      return done != 0;
    });
  }
};

Ranks::Ranks() : impl_(std::make_shared<Impl>(MPI_COMM_NULL)) {}

Ranks Ranks::world() {
  Ranks ranks;
  if (start(); running()) ranks.impl_ = std::make_shared<Impl>(MPI_COMM_WORLD);
  return ranks;
}

Ranks Ranks::first(int count) const {
  Ranks part;
  if (impl_->count == 1) return part;
  MPI_Comm comm;
  MPI_Comm_split(impl_->collective, rank() < count ? 0 : 1 + rank(), rank(), &comm);
  part.impl_ = std::make_shared<Impl>(comm);
  MPI_Comm_free(&comm);
  return part;
}

int Ranks::rank() const { return impl_->rank; }
int Ranks::count() const { return impl_->count; }

void Ranks::sum(View<double> values) const {
  if (count() == 1) return;
  const int n = static_cast<int>(values.size);
  std::vector<double> all(root() ? values.size * count() : 0);
  MPI_Request request;
  MPI_Igather(values.data, n, MPI_DOUBLE, all.data(), n, MPI_DOUBLE, 0, impl_->collective, &request);
  impl_->complete(request);
  if (root())
    for (std::size_t i = 0; i < values.size; ++i) {
      double sum = 0;
      for (int r = 0; r < count(); ++r) sum += all[r * values.size + i];
      values[i] = sum;
    }
  MPI_Ibcast(values.data, n, MPI_DOUBLE, 0, impl_->collective, &request);
  impl_->complete(request);
}

void Ranks::max(View<double> values) const {
  if (count() == 1) return;
  MPI_Request request;
  MPI_Iallreduce(MPI_IN_PLACE, values.data, static_cast<int>(values.size), MPI_DOUBLE, MPI_MAX,
                 impl_->collective, &request);
  impl_->complete(request);
}

std::vector<std::vector<std::byte>> Ranks::gather(std::vector<std::byte> mine) const {
  std::vector<std::vector<std::byte>> all(root() ? count() : 0);
  Messages way(*this);
  if (!root()) {
    way.send(0, gather_tag, {mine.data(), mine.size()});
    way.wait();
    return all;
  }
  all[0] = std::move(mine);
  for (int r = 1; r < count(); ++r) way.receive(r, gather_tag, all[r]);
  return all;
}

std::vector<std::byte> Ranks::scatter(const std::vector<std::vector<std::byte>>& parts) const {
  if (count() == 1) return parts.at(0);
  std::vector<std::byte> mine;
  Messages way(*this);
  if (!root()) {
    way.receive(0, scatter_tag, mine);
    return mine;
  }
  for (int r = 1; r < count(); ++r) way.send(r, scatter_tag, {parts.at(r).data(), parts.at(r).size()});
  way.wait();
  return parts.at(0);
}

void Ranks::broadcast(std::vector<std::byte>& bytes) const {
  if (count() == 1) return;
  std::vector<std::vector<std::byte>> parts(root() ? count() : 0, bytes);
  bytes = scatter(parts);
}

void Ranks::on_root(const std::function<void()>& action) const {
  guarded([&] {
    if (root()) action();
    double done = 0;
    max({&done, 1});  // the others wait here, and hear of an error
  });
}

void Ranks::guarded(const std::function<void()>& action) const {
  try {
    action();
  } catch (const Error& error) {
    if (error.code != Exit::interrupted)  // which all ranks agreed on
      impl_->tell(error.code, error.what());
    throw;
  } catch (const std::exception& error) {
    impl_->tell(Exit::internal, error.what());
    throw;
  }
}

// ---- messages

struct Messages::Pending {
  std::vector<MPI_Request> requests;
};

Messages::Messages(Ranks ranks) : ranks_(std::move(ranks)), pending_(std::make_unique<Pending>()) {}
Messages::Messages(Messages&&) noexcept = default;

/// What is still under way belongs to a run that failed.
Messages::~Messages() {
  if (!pending_ || !running()) return;
  for (MPI_Request& request : pending_->requests)
    if (request != MPI_REQUEST_NULL) {
      MPI_Cancel(&request);
      MPI_Request_free(&request);
    }
}

void Messages::send(int to, int tag, View<const std::byte> data) {
  for (std::size_t at = 0; at == 0 || at < data.size; at += piece) {
    pending_->requests.emplace_back();
    MPI_Isend(data.data + at, static_cast<int>(std::min(piece, data.size - at)), MPI_BYTE, to, tag,
              ranks_.impl_->messages, &pending_->requests.back());
  }
  // A message of whole pieces ends with an empty one, so that the receiver of any length knows.
  if (data.size > 0 && data.size % piece == 0) {
    pending_->requests.emplace_back();
    MPI_Isend(data.data, 0, MPI_BYTE, to, tag, ranks_.impl_->messages, &pending_->requests.back());
  }
}

void Messages::receive(int from, int tag, View<std::byte> data) {
  contract(data.size < piece, "a message of known length is longer than one piece");
  pending_->requests.emplace_back();
  MPI_Irecv(data.data, static_cast<int>(data.size), MPI_BYTE, from, tag, ranks_.impl_->messages,
            &pending_->requests.back());
}

void Messages::receive(int from, int tag, std::vector<std::byte>& data) {
  data.clear();
  for (;;) {
    MPI_Message message;
    MPI_Status status;
    ranks_.impl_->poll([&] {
      int there = 0;
      MPI_Improbe(from, tag, ranks_.impl_->messages, &there, &message, &status);
      return there != 0;
    });
    int length = 0;
    MPI_Get_count(&status, MPI_BYTE, &length);
    const std::size_t at = data.size();
    data.resize(at + static_cast<std::size_t>(length));
    MPI_Request request;
    MPI_Imrecv(data.data() + at, length, MPI_BYTE, &message, &request);
    ranks_.impl_->complete(request);
    if (static_cast<std::size_t>(length) < piece) return;
  }
}

void Messages::wait() {
  auto& requests = pending_->requests;
  if (requests.empty()) return;
  ranks_.impl_->poll([&] {
    int done = 0;
    MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
    return done != 0;
  });
  requests.clear();
}

// ---- agreement

struct Agreement::State {
  unsigned mine = 0, any = 0;
  MPI_Request request = MPI_REQUEST_NULL;
};

Agreement::Agreement(Ranks ranks) : ranks_(std::move(ranks)), state_(std::make_unique<State>()) {}

Agreement::~Agreement() {
  if (state_->request == MPI_REQUEST_NULL) return;
  if (ranks_.impl_->failed || std::uncaught_exceptions() > 0) {
    (void)state_.release();  // MPI may still write there
    return;
  }
  MPI_Wait(&state_->request, MPI_STATUS_IGNORE);
}

unsigned Agreement::any(unsigned mine) {
  if (ranks_.count() == 1) return mine;
  if (state_->request != MPI_REQUEST_NULL) {
    MPI_Request request = std::exchange(state_->request, MPI_REQUEST_NULL);
    ranks_.impl_->complete(request);
  }
  const unsigned before = state_->any;
  state_->mine = mine;
  MPI_Iallreduce(&state_->mine, &state_->any, 1, MPI_UNSIGNED, MPI_BOR, ranks_.impl_->collective,
                 &state_->request);
  return before;
}

}  // namespace hemowalk::mpi
