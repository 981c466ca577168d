"""Sets of errors in the data are explanations like others: which are searched, and what a lost sample counts.

Configuration: searches that are told what they find. Tolerance: of a mean density of 400 samples.
"""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import subzero
from benchmarks.diagnosis import world
from subzero import Logged
from subzero.diagnosis import Setting
from subzero.diagnosis.inference import DataError, Linear, Noise, Observed, Problem, data_error_choice, pose
from subzero.diagnosis.inference.data_error_choice import compared
from subzero.diagnosis.inference.data_error_evidence import Explained, Numbers
from subzero.diagnosis.inference.data_error_scan import log_prior
from subzero.diagnosis.inference.data_error_search import SuspectedError, Suspects, suspected
from subzero.records.record import Record

TIME = np.arange(0.0, 30.01, 0.1)
STEP = DataError(kind="step", channels=("pitch",), amount=3.0, since=12.0)


def smooth() -> Logged:
    """Return a record of a smooth pitch on fig6."""
    trial = subzero.load_scenario("fig6")
    record = Record(source="made", time=TIME, values={"pitch": np.sin(0.3 * TIME)})
    return Logged(record=record, setting=Setting(trial=trial, model=subzero.Model.of(trial)), name="fig6")


class DiagnosisSteps:
    """A search with a log evidence that is told; `helped` is what the causes of another search bring it to."""

    def __init__(self, plain: float, helped: float, put_right: float) -> None:
        self.plain, self.helped, self.put_right = plain, helped, put_right
        self.entries, self.started, self.finished = (), list[str](), list[str]()

    def start(self, records):
        is_plain = records[0] is PLAIN
        found = self.plain if is_plain else self.put_right
        fit = SimpleNamespace(log_posterior=found, optimistic_log_posterior=found,
                              fit=SimpleNamespace(r=np.ones(100)))  # fmt: skip
        problem = SimpleNamespace(entries=self.entries, records=[SimpleNamespace(noise={}, values={})])
        search = SimpleNamespace(is_far=is_plain, is_poor=lambda: is_plain, best=lambda: fit, candidates={(): fit},
                                 screen=SimpleNamespace(log_posterior={}))  # fmt: skip
        search.beliefs = SimpleNamespace(log_total=lambda: fit.log_posterior)
        search.fit_like = lambda other: vars(fit).update(log_posterior=max(found, self.helped))
        name = "as it is" if is_plain else "put right"
        return SimpleNamespace(problem=problem, search=search, out_of_catalogue=[], complete=True, given_up=False,
                               name=name)  # fmt: skip

    def begin(self, work, is_hopeless):
        self.started.append(work.name)
        work.given_up = is_hopeless()

    def finish(self, work):
        self.finished.append(work.name)


PLAIN = smooth()


@pytest.fixture(autouse=True)
def _numbers_stay_as_they_are(monkeypatch):
    """Let the numbers of errors be those that were told: there is no model to find others with."""
    monkeypatch.setattr(data_error_choice, "numbers_again", lambda one, records: Numbers(one.errors))


@pytest.mark.parametrize(
    ("helped", "is_given_up"), [(-1000.0, True), (-10.0, False)], ids=["no", "with its causes"]
)
def test_a_record_that_is_far_is_given_up_where_it_is_hopelessly_behind_what_was_put_right(
    helped, is_given_up
):
    """Its first look, which takes long from afar, waits for the other, and tries what explains that."""
    step = SuspectedError(record=0, error=STEP, lead=100.0, generous=90.0, left=0.6)
    look = DiagnosisSteps(plain=-1000.0, helped=helped, put_right=0.0)
    tried = compared(Suspects(errors=(step,)), [PLAIN], look)
    assert look.started == ["as it is", "put right"]
    assert set(look.finished) == ({"put right"} if is_given_up else {"put right", "as it is"})
    assert [one.work.given_up for one, _ in tried] == [False, is_given_up]


@pytest.mark.parametrize(("channel", "level"), [("heading", 2.0), ("depth", 0.005)])
def test_a_lost_sample_counts_as_one_of_its_own_channel(channel, level):
    """Of white noise σ it has, but for a constant, the log density −log σ − ½: more in metres than in degrees."""
    time, levels, count = np.arange(0.0, 40.0, 0.1), {"heading": 2.0, "depth": 0.005}, 400
    rng = np.random.default_rng(5)
    values = {name: one * rng.standard_normal(count) for name, one in levels.items()}
    noise = {name: Noise(white=one, slow=0.01 * one, correlation_time=2.0, resolution=0.0,
                         used=np.ones(count, dtype=bool), time=time) for name, one in levels.items()}  # fmt: skip
    record = SimpleNamespace(noise=noise, values=values, known={}, noise_times={})
    residual = np.concatenate([noise[name].whiten(column) for name, column in values.items()])
    best = SimpleNamespace(log_posterior=0.0, fit=SimpleNamespace(r=residual))
    search = SimpleNamespace(best=lambda: best, beliefs=SimpleNamespace(log_total=lambda: 0.0))
    work = SimpleNamespace(problem=SimpleNamespace(records=[record]), search=search, out_of_catalogue=[])
    lost = Explained(errors=(), work=work, log_prior=0.0, lost={channel: 40})
    gained = lost.log_evidence(lost.means) - lost.log_evidence({})
    assert gained == pytest.approx(
        40 * (-np.log(level) - 0.5), abs=40 * 0.15
    )  # 400 samples: ½ ± 0.04; and a prior


LEVELS = {"heading": 2.0, "depth": 0.005}
LATE = DataError(kind="latency", channels=("heading",), amount=3.0)


class Quiet:
    """A search that finds nothing but white noise, in records that show nothing else."""

    def start(self, records):
        noise = {name: white_noise(records[0], name) for name in LEVELS}
        seen = Observed(name="one", time=records[0].record.time, values=records[0].record.values, noise=noise,
                        setting=None)  # fmt: skip
        residual = np.concatenate([one.whiten(seen.values[name]) for name, one in noise.items()])
        problem = Problem(records=(seen,), entries=())
        linear = Linear(residual, np.zeros((residual.size, 1)))
        what = SimpleNamespace(linear=lambda *_: (linear, np.ones(1)))
        found = SimpleNamespace(log_posterior=-0.5 * float(residual @ residual), id="sensor_drift:depth", point=None,
                                own=None, causes=(), what=what)  # fmt: skip
        fit = SimpleNamespace(
            log_posterior=-np.inf, optimistic_log_posterior=-np.inf, fit=SimpleNamespace(r=residual)
        )
        search = SimpleNamespace(problem=problem, is_far=False, is_poor=lambda: True, best=lambda: fit,
                                 candidates={(): fit}, screen=SimpleNamespace(log_posterior={(): 0.0}),
                                 fit_like=lambda other: None,
                                 beliefs=SimpleNamespace(log_total=lambda: -np.inf))  # fmt: skip
        return SimpleNamespace(
            problem=problem, search=search, out_of_catalogue=[found], complete=True, given_up=False
        )

    def begin(self, work, is_hopeless):
        work.given_up = is_hopeless()

    def finish(self, work):
        pass


def white_noise(logged, name):
    """Return the noise of a channel, without what stands far off."""
    values, level = logged.record.values[name], LEVELS[name]
    used = np.isfinite(values) & (np.abs(values) < 20.0 * level)
    return Noise(
        white=level, slow=0.05 * level, correlation_time=2.0, used=used, time=logged.record.time[used]
    )


def lead_of_a_delay(outlier):
    """Return by how much a delay of the heading is more probable than none, where nothing but noise is shown."""
    rng = np.random.default_rng(8)
    values = {name: level * rng.standard_normal(TIME.size) for name, level in LEVELS.items()}
    values["heading"][10] = outlier  # at 1 s: outside the trial, if the heading is 3 s late
    logged = dataclasses.replace(PLAIN, record=Record(source="made", time=TIME, values=values))
    late = SuspectedError(record=0, error=LATE, lead=100.0, generous=90.0, left=0.6)
    found = {len(one.errors): log for one, log in compared(Suspects(errors=(late,)), [logged], Quiet())}
    return found[1] - found[0]


@pytest.mark.parametrize("outlier", [0.0, 60.0, np.nan], ids=["none", "outlier", "gap"])
def test_a_delay_of_nothing_but_noise_is_as_probable_as_beforehand(outlier):
    """What it puts outside the trial speaks neither for nor against it, whether measured, lost, or an outlier. The
    noise is found anew without these samples: a nat.
    """
    assert lead_of_a_delay(outlier) == pytest.approx(log_prior(LATE, 10), abs=1.0)


class Interrupted(DiagnosisSteps):
    """A search that is interrupted when it has been started so often."""

    def __init__(self, *args, at: int) -> None:
        super().__init__(*args)
        self.left = at

    def start(self, records):
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt
        return super().start(records)


def step_explains_nothing(one, records):
    """Hold a step to explain nothing by the same samples."""
    return Numbers(one.errors, needless=one.errors)


def test_an_error_that_explains_nothing_gives_way_to_a_whole_search_without_it(monkeypatch):
    """That had been given up, as the set with the error seemed to explain more."""
    monkeypatch.setattr(data_error_choice, "numbers_again", step_explains_nothing)
    step = SuspectedError(record=0, error=STEP, lead=100.0, generous=90.0, left=0.6)
    look = DiagnosisSteps(plain=-1000.0, helped=-1000.0, put_right=0.0)
    ((found, _),) = compared(Suspects(errors=(step,)), [PLAIN], look)
    assert not found.errors
    assert not found.work.given_up
    assert look.finished == ["put right", "as it is"]


def test_an_interrupt_of_that_search_keeps_what_was_found(monkeypatch):
    monkeypatch.setattr(data_error_choice, "numbers_again", step_explains_nothing)
    step = SuspectedError(record=0, error=STEP, lead=100.0, generous=90.0, left=0.6)
    look = Interrupted(-1000.0, -1000.0, 0.0, at=3)
    tried = compared(Suspects(errors=(step,)), [PLAIN], look)
    assert {len(one.errors) for one, _ in tried} == {0, 1}
    assert not all(one.work.complete for one, _ in tried)


@pytest.mark.long
def test_what_would_make_a_quiet_channel_loud_is_not_suspected():
    """A rounded heading hardly leaves a value: radians explain its steps, worth 74 nats, and nothing else of it. The
    right verdict took 100 s.
    """
    logged, _ = world.record_of(world.drawn(12001, 555)[554])
    assert not suspected(pose([logged]), [logged]).errors
