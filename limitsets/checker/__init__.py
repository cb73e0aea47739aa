"""Check a proof certificate of a throw-and-catch feeder, or of a map: written from the physics, not from the prover.

    python recheck.pyz FILE [--json] [--formulas] [--workers N]      # this package, in one file: `make checker`
    python -m limitsets.checker FILE                                 # the same

The checker needs Python, numpy and python-flint, and nothing else of the package that wrote the certificate.  It
believes integer comparisons, exact rationals, and signs of balls that Arb computed.  A certificate comes from a
stranger: it is data, and the checker neither evaluates nor unpickles it nor uses it as a path.

The proof is about one throw map: a part rests on side i at x = R, the arm throws it, it lands on its left vertex at the
angle phi and either falls back ("jog") or over that vertex on side i+1 ("flip").  The certificate cuts every side into
cells.  For every cell it says how the throw decides, where the images lie and what bracket holds phi; the checker
proves each of these anew, for all x in the cell and all parameters allowed, and follows the integers to the claims.
A certificate of any other map holds its formulas, as data.

A function that checks a statement returns where it proves the statement, and else raises UnprovedError with the reason
in words for people; whoever reports it is the only one to catch that.
The files follow docs/certificates.md, and each imports only from those before it:

    balls        the arithmetic of every proof
    labels       components and ranks, by whole numbers                           5
    file         the zip, the header and the arrays; texts, quantities and JSON   "The file"
    part         side by side, what the part is like
    scene        the part on the arm, kappa, noise and tolerance                  "What is claimed"
    model        the formulas of a throw
    cells        structure and ranks; decision, landing and images of every cell  1 to 5
    near_hinge   starts before the first cell                                     6, "The surface above the joint"
    near_foot    the same with noise of the landing place                         "For which starts"
    starts       the starts for which a goal holds                                7, 8, "For which starts"
    moving_ends  chains of throws, all with the same parameters                   9
    bands        bands of attracting cells under such throws                      9
    goals        the goals                                                        "Goals"
    end_points   end points of the limit set                                      10 to 12
    refutations  periodic orbits, and orbits that refute a goal                   13, "Refutations"
    feeding      what can be reached before the end of the arm, and beyond it     17, "Feeding"
    region       one cell of a plane of parameters                                "Regions"
    plane        a plane of parameters in cells, and its regions
    policy       a policy for a sensor of one bit, and its table                  "Policies"
    program      formulas as operations: read, evaluated, printed                 "Certificates of any map"
    observable   what is averaged along orbits                                    "Averages"
    orbit_average  its average on a line: one inequality for each cell
    throw_average  what this needs of throws
    entropy      intervals that images meet and cover                             "Entropy"
    throw_entropy  the laps of the throw
    claims       the claims of a file, and what each needs
    laws         the laws of what deviates, in strata                             20
    noisy_throw  a throw with a speed that deviates, and its derivatives          18
    means        means over what deviates, in floats                              20
    landings     the throws of one side of a noisy chain, and their branches      18, 19
    steps        one step of a noisy chain                                        21
    horizon      any number of steps                                              23
    absorption   where a chain ends, and when: what is claimed, and its brackets  22
    links        what a step needs of every cell, and the chain of it             20, 21
    brackets     the noisy chain of a scene, and its claim                        22, "Probabilities"
    log_slopes   ln |dx'/dx| of throws whose speed deviates
    long_run     averages of a noisy chain over ever more throws                  "Long-run averages"
    policy_chances  throws of a policy in the mean, and parts that come           "Chances of a policy"
    any_map      the map of a file, and one cell of it
    map_cells    the cells, their labels
    map_cycles   periodic orbits, and balls around them
    map_orbits   lists of all orbits
    map_plane    regions of parameters, and shares of them
    map_average  what averages need of the cells of a map
    map_entropy  its laps
    noisy_map    steps of a map of a line that scatter                            "Steps that land with noise"
    noisy_circle  the same on axes that close
    map_chances  where such orbits end, and when                                  "Where orbits with noise end"
    map_long_run  averages along such orbits
    map_file     the file of a map
    map_words    what is proved, in sentences
    map_weights  almost every start
    map_claims   the claims
    report       a file from first to last, and the report about it
    main         the command line
"""

from .main import show
from .report import EXITS, Report, recheck

__all__ = ["EXITS", "Report", "recheck", "show"]
