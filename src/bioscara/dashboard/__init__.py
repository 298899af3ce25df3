"""The operator's page in the browser, and the answers to it that are no messages of the owner.

``page/`` has what a browser loads: plain modules of JavaScript, begun by ``js/main.js``, with
three.js and uPlot in ``vendor/``. ``assets`` reads them all once. The gateway
(:mod:`bioscara.web`) serves them, and what the other modules compute, after its checks.
"""
