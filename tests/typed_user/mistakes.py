"""Mistakes that a type checker finds: one in each line that says so."""

import gmwm
from gmwm import GaussMarkov, WhiteNoise

a = GaussMarkov().taau  # mistake
b = GaussMarkov(tua=3.0)  # mistake
c = WhiteNoise("0.1")  # mistake
d = gmwm.fit(WhiteNoise(), [0.1, 0.2], dtt=0.01)  # mistake
e = gmwm.fit(WhiteNoise(), [0.1, 0.2], 0.01, method=gmwm.EM(tolerence=1e-8))  # mistake
f = gmwm.fit(WhiteNoise(), [0.1, 0.2], 0.01).parms  # mistake
g = gmwm.fit(WhiteNoise(), [0.1, 0.2], 0.01)["N"].valu  # mistake
h = gmwm.select([0.1, 0.2], 0.01, max_gauss_markof=2)  # mistake
i = gmwm.calibrat  # mistake
