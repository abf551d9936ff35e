// The reference of `onboard jitter`: wake-up latency of a bare thread, as cyclictest measures it. A separate process
// calls this; the flight program does not.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <sys/prctl.h>
#include <time.h>

namespace nb = nanobind;

static constexpr long long SECOND_NS = 1000000000;

static long long now_ns() {
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * SECOND_NS + now.tv_nsec;
}

static void wake_into(long long interval_ns, nb::ndarray<long long, nb::ndim<1>, nb::c_contig, nb::device::cpu> late_ns) {
    nb::gil_scoped_release unlocked;
    prctl(PR_SET_TIMERSLACK, 1);  // the strictest reference: by default the kernel may add 50 us
    long long due_ns = now_ns();
    for (std::size_t k = 0; k < late_ns.shape(0); ++k) {
        due_ns += interval_ns;
        const timespec due{due_ns / SECOND_NS, due_ns % SECOND_NS};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr)) {}
        late_ns.data()[k] = now_ns() - due_ns;
    }
}

NB_MODULE(_wakes, m) { m.def("wake_into", &wake_into); }
